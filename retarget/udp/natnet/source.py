"""A NatNet server as a source of marker frames.

    with NatNetSource("natnet://192.168.1.10") as source:
        for frame in source:
            ...

Axes are those that the server streams in (Motive: +Y up), lengths are metres whatever the server's unit is. A marker
that was not seen is a NaN row. The iteration ends when the server takes its leave or the source is closed; silence
does not end it: the server is tried again until it answers.
"""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING

from retarget.errors import ConnectionFailedError
from retarget.udp.natnet.discovery import find_server
from retarget.udp.natnet.link import Link
from retarget.udp.natnet.session import PREPARE_S, NatNetSession, Phase
from retarget.udp.natnet.url import NatNetUrl, parse_natnet_url
from retarget.udp.sockets import local_address_towards, resolve
from retarget.udp.stats import StreamStats

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from retarget.frames import MarkerFrame, MarkerLayout
    from retarget.udp.datagram import Datagram
    from retarget.udp.natnet.messages import ServerInfo
    from retarget.udp.sockets import Address

QUEUE_FRAMES = 4096
"""Frames that wait for a lagging reader before the oldest go: 17 s at 240 Hz."""

_log = logging.getLogger("retarget.natnet")
_SHORT_WAIT_S, _LONGEST_WAIT_S = 0.05, 0.5


class NatNetSource:
    """Iterator of `MarkerFrame`; open it as a context manager.

    `tap` is given every datagram as it comes and goes, before any can be dropped. Entering raises `InputError` for an
    address that cannot be read and `ConnectionFailedError` when nobody answers within `patience_s` [s].
    """

    def __init__(
        self,
        url: str | NatNetUrl,
        *,
        tap: Callable[[Datagram], None] | None = None,
        patience_s: float = 4.0,
        queue_frames: int = QUEUE_FRAMES,
    ) -> None:
        self._url = parse_natnet_url(url) if isinstance(url, str) else url
        self._tap = tap
        self._patience_s = patience_s
        self._queue_frames = queue_frames
        self._session = NatNetSession()
        self._link: Link | None = None
        self._first: MarkerFrame | None = None

    def __enter__(self) -> NatNetSource:
        server, local = self._addresses()
        wanted = None if self._url.multicast else self._url.bitstream
        self._session = NatNetSession(f"{server[0]}:{server[1]}", wanted)
        self._link = Link(server, local, capacity=self._queue_frames, tap=self._tap)
        try:
            self._connect(self._link)
        except BaseException:
            self._link.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[MarkerFrame]:
        return self

    def __next__(self) -> MarkerFrame:
        if self._first is not None:
            first, self._first = self._first, None
            return first
        link = self._opened()
        while self._session.phase is not Phase.ENDED and not link.closed:
            frame = self._step(link, _LONGEST_WAIT_S)
            if frame is not None:
                return frame
        raise StopIteration

    def stop(self) -> None:
        """End the iteration soon; may be called from another thread or from a signal's function."""
        if self._link is not None:
            self._link.stop()

    def close(self) -> None:
        """Leave the server. Counts stay."""
        if self._link is not None:
            self._link.close()

    @property
    def server(self) -> ServerInfo | None:
        """What the server said of itself."""
        return self._session.server

    @property
    def session(self) -> NatNetSession:
        """The connection's state: its bitstream, clock and phase."""
        return self._session

    @property
    def layout(self) -> MarkerLayout:
        """All markers known so far; each frame carries its own."""
        return self._session.layout

    @property
    def rate_hz(self) -> float | None:
        """Frames per second, where the server told."""
        return self._session.rate_hz

    @property
    def stats(self) -> StreamStats:
        """What became of the datagrams up to now."""
        framing, link = self._session.framing, self._link
        dropped = link.dropped if link is not None else 0
        return StreamStats(
            received=framing.delivered,
            lost=max(0, framing.lost - dropped),
            doubled=framing.doubled,
            late=framing.late,
            malformed=self._session.malformed,
            foreign=link.foreign if link is not None else 0,
            dropped=dropped,
            overflowed=link.overflowed if link is not None else 0,
            reconnects=self._session.reconnects,
        )

    def _opened(self) -> Link:
        if self._link is None:
            raise ConnectionFailedError(f"{self._url} is not open; use it as a context manager.")
        return self._link

    def _addresses(self) -> tuple[Address, str]:
        """Where the server is and from which of our addresses it is reached."""
        if self._url.host is None:
            found = find_server(self._url.port, self._url.local)
            return found.address, self._url.local or found.local
        host = resolve(self._url.host)
        return (host, self._url.port), self._url.local or local_address_towards(host)

    def _connect(self, link: Link) -> None:
        """Connect, listen where the server sends to, and wait until frames have names and times."""
        deadline_s = time.monotonic() + self._patience_s
        while self._session.phase is Phase.CONNECTING:
            if time.monotonic() > deadline_s:
                raise ConnectionFailedError(_advice(link.server))
            self._step(link, _SHORT_WAIT_S)
        deadline_s = time.monotonic() + PREPARE_S
        while not self._session.ready(time.monotonic()) and self._session.phase is not Phase.ENDED:
            if time.monotonic() > deadline_s:
                _log.warning("%s:%d tells no marker names; they are numbered until it does.", *link.server)
                return
            self._first = self._step(link, _SHORT_WAIT_S)
            if self._first is not None:
                return

    def _step(self, link: Link, longest_wait_s: float) -> MarkerFrame | None:
        """Send what is due, and take at most one datagram."""
        now_s = time.monotonic()
        for payload in self._session.due(now_s):
            self._session.sent(payload, link.send(payload))
        arrival = link.receive(min(longest_wait_s, max(0.0, self._session.next_due_s(now_s) - now_s)))
        if arrival is None:
            return None
        frame = self._session.receive(arrival.payload, arrival.received_s)
        if not arrival.is_frame:
            self._follow_group(link)
        return frame

    def _follow_group(self, link: Link) -> None:
        """Join the group that is wanted, or that the server announces."""
        if self._session.server is None:
            return
        group = self._url.group_for(self._session.server.connection)
        if group is not None:
            link.join(group)


def _advice(server: Address) -> str:
    return (
        f"Nobody answers at {server[0]}, command port {server[1]}. Check that the address is right, that the streaming "
        "pane of Motive (or `retarget replay`) is switched on and set to the same interface, that both ends are on one "
        "network, and that no firewall drops UDP on this port."
    )
