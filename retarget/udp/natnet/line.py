"""The connection to a server that is examined: a session on its sockets, and what is observed beside it."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import TYPE_CHECKING

from retarget.errors import ConnectionFailedError
from retarget.udp.natnet.link import Link
from retarget.udp.natnet.observation import Observation
from retarget.udp.natnet.session import NatNetSession
from retarget.udp.natnet.source import QUEUE_FRAMES
from retarget.udp.stats import StreamStats

if TYPE_CHECKING:
    from collections.abc import Callable

    from retarget.udp.natnet.url import NatNetUrl
    from retarget.udp.sockets import Address

_TICK_S = 0.02


class Line:
    """Goes on only while it is told to `run`; use it as a context manager."""

    def __init__(self, url: NatNetUrl, server: Address, local: str) -> None:
        self.session = NatNetSession(f"{server[0]}:{server[1]}", None if url.multicast else url.bitstream)
        self.link = Link(server, local, capacity=QUEUE_FRAMES, tap=None)
        self.observed = Observation()

    def __enter__(self) -> Line:
        return self

    def __exit__(self, *_: object) -> None:
        self.link.close()

    @property
    def stats(self) -> StreamStats:
        """What became of the datagrams up to now."""
        framing, dropped = self.session.framing, self.link.dropped
        return StreamStats(
            received=framing.delivered,
            lost=max(0, framing.lost - dropped),
            doubled=framing.doubled,
            late=framing.late,
            malformed=self.session.malformed,
            foreign=self.link.foreign,
            dropped=dropped,
            overflowed=self.link.overflowed,
            reconnects=self.session.reconnects,
        )

    def run(self, reached: Callable[[], bool], longest_s: float) -> None:
        """Let the session go on until `reached`, the server takes its leave, or `longest_s` [s] are over."""
        deadline_s = time.monotonic() + longest_s
        while not reached() and not self.observed.ended and time.monotonic() < deadline_s:
            self._exchange()

    def watch(self, seconds: float) -> None:
        """Let the session go on for so long [s]."""
        self.run(lambda: False, seconds)

    def _exchange(self) -> None:
        """Send what is due and take at most one datagram."""
        for payload in self.session.due(time.monotonic()):
            self.session.sent(payload, self.link.send(payload))
        arrival = self.link.receive(_TICK_S)
        if arrival is None:
            return
        frame = None
        with suppress(ConnectionFailedError):  # too old a server: its answer is observed all the same
            frame = self.session.receive(arrival.payload, arrival.received_s)
        self.observed.take(arrival, frame, self.session.bitstream, self.session.clock)
