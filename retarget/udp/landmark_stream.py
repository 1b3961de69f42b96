"""From datagrams of points to marker frames: names, order and time; no socket.

The sender's clock is mapped to ours one way: of all differences between arrival and sending the least is the truest, as
a datagram can be late but never early. It is let grow by 100 parts in a million, so that clocks may drift apart.
"""

from __future__ import annotations

from retarget.errors import ProtocolError
from retarget.frames import MarkerFrame, MarkerLayout
from retarget.udp.landmarks import LayoutMessage, PointsMessage, decode
from retarget.udp.natnet.sequence import Arrival, FrameSequence

DRIFT = 1e-4
"""By which two clocks may run apart [s/s]."""
MAX_LAYOUTS = 16
"""Layouts remembered of one sender."""


class OneWayClock:
    """The sender's time on the local monotonic clock."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the sender."""
        self._offset_s: float | None = None
        self._last_s = 0.0

    def local(self, sent_s: float, received_s: float) -> float:
        """When `sent_s` of the sender was here [s], for a datagram that arrived at `received_s`."""
        offset_s = received_s - sent_s
        if self._offset_s is not None:
            offset_s = min(offset_s, self._offset_s + DRIFT * max(0.0, received_s - self._last_s))
        self._offset_s, self._last_s = offset_s, received_s
        return sent_s + offset_s


class LandmarkStream:
    """Takes datagrams one by one; answers with a frame when there is one."""

    def __init__(self) -> None:
        self._layouts: dict[int, MarkerLayout] = {}
        self._session: int | None = None
        self._sequence = FrameSequence()
        self._clock = OneWayClock()
        self.received = 0
        """Frames handed on."""
        self.unnamed = 0
        """Frames that came before their names."""
        self.doubled = 0
        self.late = 0
        """Overtaken by newer ones."""
        self.malformed = 0
        """Datagrams that do not follow the protocol."""
        self.confidence = 0.0
        """Of the frame handed on last."""

    @property
    def lost(self) -> int:
        """Frames that never came."""
        return self._sequence.lost

    def receive(self, payload: bytes, received_s: float) -> MarkerFrame | None:
        """The frame in `payload`, None where it holds none that can be used."""
        try:
            message = decode(payload)
        except ProtocolError:
            self.malformed += 1
            return None
        if isinstance(message, LayoutMessage):
            self._learn(message)
            return None
        return self._frame(message, received_s)

    def _learn(self, message: LayoutMessage) -> None:
        if message.layout_id in self._layouts:
            return
        if len(self._layouts) >= MAX_LAYOUTS:
            self._layouts.pop(next(iter(self._layouts)))
        self._layouts[message.layout_id] = message.layout

    def _frame(self, message: PointsMessage, received_s: float) -> MarkerFrame | None:
        if message.session != self._session:
            self._session = message.session
            self._sequence.restart()
            self._clock.reset()
        layout = self._layouts.get(message.layout_id)
        if not self._is_new(message.sequence):
            return None
        if layout is None or len(layout.names) != len(message.positions):
            self.unnamed += 1
            return None
        self.received += 1
        self.confidence = message.confidence
        time_s = self._clock.local(message.time_s, received_s)
        return MarkerFrame(message.sequence, time_s, received_s, layout, message.positions)

    def _is_new(self, sequence: int) -> bool:
        arrival = self._sequence.judge(sequence)
        self.doubled += arrival is Arrival.DOUBLED
        self.late += arrival is Arrival.LATE
        if arrival is Arrival.RESTARTED:
            self._clock.reset()
        return arrival in {Arrival.NEXT, Arrival.RESTARTED}
