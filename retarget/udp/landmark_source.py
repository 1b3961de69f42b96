"""Datagrams of points (`retarget.udp.landmarks`) as a source of marker frames.

    with LandmarkSource("udp://:11550") as source:
        for frame in source:
            ...

Without a host it listens on loopback alone; ``udp://0.0.0.0:PORT`` hears every network of this machine. One sender is
listened to at a time: the first, until it has been silent for three seconds. Silence does not end the iteration.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Self

from retarget.errors import ConnectionFailedError
from retarget.udp.address import parse_address
from retarget.udp.landmark_stream import LandmarkStream
from retarget.udp.landmarks import MAGIC, is_points
from retarget.udp.receiver import Inbox, Receiver
from retarget.udp.sockets import open_udp

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import TracebackType

    from retarget.frames import MarkerFrame
    from retarget.udp.datagram import Datagram
    from retarget.udp.receiver import Channel
    from retarget.udp.sockets import Address, Received, UdpSocket

QUEUE_FRAMES = 1024
"""Frames that wait for a lagging reader before the oldest go."""
SILENCE_S = 3.0
"""After which another sender may be heard."""
_LONGEST_WAIT_S = 0.5


class LandmarkSource:
    """Iterator of `MarkerFrame`; a `Source` of the pipeline."""

    live = True
    rate_hz = None
    frame_count = None

    def __init__(self, url: str, *, tap: Callable[[Datagram], None] | None = None) -> None:
        """`tap` is given every datagram of the sender before any can be dropped; InputError for a wrong address."""
        self._local = parse_address(url, "udp")
        self._tap = tap
        self._inbox = Inbox(QUEUE_FRAMES)
        self._stream = LandmarkStream()
        self._sender = _OneSender()
        self._socket: UdpSocket | None = None
        self._receiver: Receiver | None = None
        self._stopped = threading.Event()

    @property
    def address(self) -> Address:
        """Where it listens, once open."""
        return self._local if self._socket is None else self._socket.address

    @property
    def confidence(self) -> float:
        """What the sender said of the frame given last, 0 to 1."""
        return self._stream.confidence

    def counts(self) -> dict[str, int]:
        """What became of the datagrams."""
        stream = self._stream
        return {
            "received": stream.received,
            "lost": stream.lost,
            "doubled": stream.doubled,
            "late": stream.late,
            "malformed": stream.malformed,
            "unnamed": stream.unnamed,
            "foreign": self._receiver.foreign if self._receiver is not None else 0,
            "dropped": self._inbox.dropped,
        }

    def stop(self) -> None:
        """End the iteration soon; may be called from another thread or from a signal's function."""
        self._stopped.set()
        self._inbox.close()

    def __enter__(self) -> Self:
        """`ConnectionFailedError` where the port is in use or the address is not this machine's."""
        self._socket = open_udp(*self._local)
        self._receiver = Receiver(
            {"data": self._socket}, self._inbox, accept=self._sender.accept, is_frame=is_points, tap=self._tap
        )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
        if self._receiver is not None:
            self._receiver.close()
        if self._socket is not None:
            self._socket.close()

    def __iter__(self) -> Iterator[MarkerFrame]:
        if self._receiver is None:
            raise ConnectionFailedError("The source of landmarks is not open; use it as a context manager.")
        while not self._stopped.is_set():
            arrival = self._inbox.get(_LONGEST_WAIT_S)
            frame = None if arrival is None else self._stream.receive(arrival.payload, arrival.received_s)
            if frame is not None:
                yield frame


class _OneSender:
    """Says whose datagrams count. Called on the receiver's thread alone."""

    def __init__(self) -> None:
        self._peer: Address | None = None
        self._heard_s = 0.0

    def accept(self, channel: Channel, received: Received) -> bool:  # noqa: ARG002 - there is one channel
        if not received.payload.startswith(MAGIC):
            return False
        if received.peer != self._peer and self._peer is not None and received.received_s < self._heard_s + SILENCE_S:
            return False
        self._peer, self._heard_s = received.peer, received.received_s
        return True
