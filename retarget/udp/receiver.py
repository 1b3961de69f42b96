"""The border between the network and the pipeline: one thread that only receives, stamps and hands over.

What it hands over waits in an `Inbox`. When the reader lags, the oldest frames go and are counted, so that what is
shown is never older than the queue is long; other messages are kept. A tap sees every datagram before the inbox does.
"""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Literal, NamedTuple

from retarget.udp.datagram import Datagram
from retarget.udp.sockets import wait_readable

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from retarget.udp.sockets import Address, Received, UdpSocket

Channel = Literal["command", "data"]

_KEPT_MESSAGES = 256
_BURST = 256  # datagrams taken from one socket before the others are looked at
_LONGEST_WAIT_S = 0.5
_LONGEST_FAREWELL_S = 5.0


class Arrival(NamedTuple):
    """What waits in an inbox."""

    payload: bytes
    received_s: float
    """Local monotonic [s]."""
    is_frame: bool


class Inbox:
    """A bounded queue between two threads in which the newest frames win.

    `capacity` counts everything that waits; frames that had to go are counted in `dropped`. There is no lock that one
    thread could hold while the other ends it: also a signal's function may `close` it.
    """

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._waiting: SimpleQueue[Arrival | None] = SimpleQueue()  # None only wakes the reader
        self._rescued: deque[Arrival] = deque(maxlen=_KEPT_MESSAGES)  # all older than what waits
        self._failure: BaseException | None = None
        self._closed = False
        self.dropped = 0

    @property
    def closed(self) -> bool:
        """Whether the reader should stop."""
        return self._closed

    def put(self, arrival: Arrival) -> None:
        """Add the newest."""
        if self._waiting.qsize() >= self._capacity:
            self._make_room()
        self._waiting.put(arrival)

    def get(self, timeout_s: float) -> Arrival | None:
        """Take the oldest; None after `timeout_s` [s] or once closed. Raises what the receiver failed with."""
        try:
            return self._rescued.popleft()
        except IndexError:
            arrival = self._take(0.0 if self._closed or self._failure is not None else timeout_s)
        if arrival is None and self._failure is not None:
            raise self._failure
        return arrival

    def fail(self, failure: BaseException) -> None:
        """Let the reader know that nothing more will come, once it has read what waits."""
        self._failure = failure
        self._waiting.put(None)

    def close(self) -> None:
        """Let a waiting reader go."""
        self._closed = True
        self._waiting.put(None)

    def _take(self, timeout_s: float) -> Arrival | None:
        try:
            return self._waiting.get(block=timeout_s > 0.0, timeout=timeout_s)
        except Empty:
            return None

    def _make_room(self) -> None:
        oldest = self._take(0.0)
        if oldest is not None and oldest.is_frame:
            self.dropped += 1
        elif oldest is not None:
            self._rescued.append(oldest)


class Receiver:
    """Reads sockets on a thread of its own until closed.

    `accept` says which datagrams come from the right peer (others are counted in `foreign`), `is_frame` which of them
    an inbox may drop, `tap` sees those accepted, and `beat` is called about every `beat_s` [s], for keep-alives.
    """

    def __init__(
        self,
        sockets: Mapping[Channel, UdpSocket],
        inbox: Inbox,
        *,
        accept: Callable[[Channel, Received], bool],
        is_frame: Callable[[bytes], bool],
        tap: Callable[[Datagram], None] | None = None,
        beat: Callable[[], None] | None = None,
        beat_s: float = 1.0,
    ) -> None:
        self._sockets = dict(sockets)
        self._inbox = inbox
        self._accept, self._is_frame, self._tap, self._beat = accept, is_frame, tap, beat
        self._beat_s = beat_s
        self._next_beat_s = time.monotonic() + beat_s
        self.foreign = 0
        self._closing = False
        self._woken, self._waker = os.pipe()
        self._thread = threading.Thread(target=self._run, name="udp receiver", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the thread; the sockets stay open, they are the caller's."""
        if self._closing:
            return
        self._closing = True
        os.write(self._waker, b"x")
        self._thread.join(_LONGEST_FAREWELL_S)  # a tap may hang on its disk
        os.close(self._waker)
        os.close(self._woken)

    def _run(self) -> None:
        try:
            while not self._closing:
                self._wait_and_take()
        except Exception as error:  # whatever it is, the reader's thread is where it can be told
            self._inbox.fail(error)

    def _wait_and_take(self) -> None:
        wait_s = min(_LONGEST_WAIT_S, self._next_beat_s - time.monotonic())
        wait_readable([*self._sockets.values(), self._woken], wait_s)
        for channel, source in reversed(self._sockets.items()):  # data before what ends it
            self._drain(channel, source)
        if self._beat is not None and time.monotonic() >= self._next_beat_s:
            self._next_beat_s = time.monotonic() + self._beat_s
            self._beat()

    def _drain(self, channel: Channel, source: UdpSocket) -> None:
        for _ in range(_BURST):
            received = source.receive()
            if received is None:
                return
            if self._accept(channel, received):
                self._hand_over(channel, received)
            else:
                self.foreign += 1

    def _hand_over(self, channel: Channel, received: Received) -> None:
        is_frame = self._is_frame(received.payload)
        if self._tap is not None:
            peer: Address = received.peer
            told: Channel = "data" if is_frame else channel
            self._tap(Datagram(received.received_s, "in", told, peer, received.payload))
        self._inbox.put(Arrival(received.payload, received.received_s, is_frame))
