"""The sockets of one client: the command channel, perhaps a group to listen to, and the thread that reads both.

Unicast frames come to the socket that connected, as the vendor's client has it; so one socket's port is all that a
firewall on the way has to know. Only what comes from the server's address counts.
"""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from retarget.udp.datagram import Datagram
from retarget.udp.natnet.codec import encode
from retarget.udp.natnet.messages import Disconnect, KeepAlive, MessageId
from retarget.udp.receiver import Inbox, Receiver
from retarget.udp.sockets import open_multicast_receiver, open_udp

if TYPE_CHECKING:
    from collections.abc import Callable

    from retarget.udp.receiver import Arrival, Channel
    from retarget.udp.sockets import Address, Received, UdpSocket

_KEEP_ALIVE = encode(KeepAlive())
_KEEP_ALIVE_S = 1.0
_FAREWELL = encode(Disconnect())
_FRAME = int(MessageId.FRAMEOFDATA).to_bytes(2, "little")


class Link:
    """Talks to the server at `server` from `local`; close it, or use it as a context manager.

    `tap` sees every datagram of both directions; it is called from two threads, never at once.
    """

    def __init__(self, server: Address, local: str, *, capacity: int, tap: Callable[[Datagram], None] | None) -> None:
        self._server = server
        self._local = local
        self._tap = tap
        self._tapping = threading.Lock()
        self._inbox = Inbox(capacity)
        self._sockets: dict[Channel, UdpSocket] = {"command": open_udp(local)}
        self._group: Address | None = None
        self._foreign = self._overflowed = 0
        self._receiver = self._listen()

    def __enter__(self) -> Link:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def server(self) -> Address:
        """Address and command port of the server."""
        return self._server

    @property
    def group(self) -> Address | None:
        """The group that is listened to, None in unicast."""
        return self._group

    @property
    def foreign(self) -> int:
        """Datagrams from somebody else."""
        return self._foreign + self._receiver.foreign

    @property
    def dropped(self) -> int:
        """Frames that went as the reader lagged behind."""
        return self._inbox.dropped

    @property
    def overflowed(self) -> int:
        """Datagrams that the kernel threw away."""
        return self._overflowed + sum(each.overflowed for each in self._sockets.values())

    @property
    def closed(self) -> bool:
        """Whether nothing more will come."""
        return self._inbox.closed

    def send(self, payload: bytes) -> float:
        """Send a message to the command port; return the local time at which it left [s]."""
        with self._tapping:  # or the answer could be told before the question, and a replay would not know it
            sent_s = time.monotonic()
            self._sockets["command"].send(payload, self._server)
            if self._tap is not None:
                self._tap(Datagram(sent_s, "out", "command", self._server, payload))
        return sent_s

    def receive(self, timeout_s: float) -> Arrival | None:
        """Wait for the next datagram of the server; None when there is none in time, or the link is closed."""
        return self._inbox.get(timeout_s)

    def join(self, group: Address) -> None:
        """Listen to a group instead of the one before. Raises `ConnectionFailedError` as `open_multicast_receiver`."""
        if group == self._group:
            return
        joined = open_multicast_receiver(*group, self._local)
        self._stop_listening()
        previous = self._sockets.pop("data", None)
        if previous is not None:
            self._overflowed += previous.overflowed
            previous.close()
        self._sockets["data"] = joined
        self._group = group
        self._receiver = self._listen()

    def stop(self) -> None:
        """Let a waiting reader return; nothing is torn down, so a signal's function may call it."""
        self._inbox.close()

    def close(self) -> None:
        """Say goodbye, stop the thread and give the ports back; a waiting reader returns."""
        self._inbox.close()
        if self._sockets["command"].fileno() < 0:
            return
        self.send(_FAREWELL)
        self._stop_listening()
        for each in self._sockets.values():
            each.close()

    def _listen(self) -> Receiver:
        return Receiver(
            self._sockets,
            self._inbox,
            accept=self._is_from_server,
            is_frame=lambda payload: payload.startswith(_FRAME),
            tap=self._tell if self._tap is not None else None,
            beat=self._keep_alive,
            beat_s=_KEEP_ALIVE_S,
        )

    def _stop_listening(self) -> None:
        self._receiver.close()
        self._foreign += self._receiver.foreign
        self._receiver.foreign = 0

    def _is_from_server(self, channel: Channel, received: Received) -> bool:
        """Frames may come from another port of the server than its answers."""
        if channel == "data" or received.payload.startswith(_FRAME):
            return received.peer[0] == self._server[0]
        return received.peer == self._server

    def _keep_alive(self) -> None:
        if self._group is None:
            self.send(_KEEP_ALIVE)

    def _tell(self, datagram: Datagram) -> None:
        if self._tap is not None:
            with self._tapping:
                self._tap(datagram)
