"""Frames of data, one after another, to `MarkerFrame`s: names, metres, local time, and which frames are of use."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from retarget.frames import MarkerFrame
from retarget.udp.natnet.clock import DelayClock
from retarget.udp.natnet.names import MarkerNames
from retarget.udp.natnet.sequence import Arrival, FrameSequence

if TYPE_CHECKING:
    from retarget.udp.natnet.clock import EchoClock
    from retarget.udp.natnet.framedata import FrameOfData
    from retarget.udp.natnet.models import ModelDef

_PLAUSIBLE_S = 1.0
_TICK_S = 1e-6


class Framing:
    """The history that the frames of one server share."""

    def __init__(self) -> None:
        self._names = MarkerNames()
        self._sequence = FrameSequence()
        self._stamp_clock = DelayClock()
        self._tick_clock = DelayClock()
        self._last_s = -math.inf
        self._echo_clock: EchoClock | None = None
        self.metres = 1.0
        """Length of the server's unit [m]."""
        self.delivered = self.doubled = self.late = 0

    @property
    def names(self) -> MarkerNames:
        """Who the markers are."""
        return self._names

    @property
    def lost(self) -> int:
        """Frames that never came."""
        return self._sequence.lost

    def describe(self, definitions: ModelDef) -> None:
        """Take new model definitions."""
        self._names.describe(definitions)

    def restart(self, echo_clock: EchoClock | None) -> None:
        """Another server: numbers and clocks start over."""
        self._sequence.restart()
        self._stamp_clock, self._tick_clock = DelayClock(), DelayClock()
        self._last_s = -math.inf
        self._echo_clock = echo_clock

    def frame(self, data: FrameOfData, received_s: float) -> MarkerFrame | None:
        """Make a frame of what arrived at `received_s` [s]; None when it came again, or after newer ones."""
        arrival = self._sequence.judge(data.number, data.ticks.transmit if data.ticks is not None else 0)
        if arrival in {Arrival.DOUBLED, Arrival.LATE}:
            self.doubled += arrival is Arrival.DOUBLED
            self.late += arrival is Arrival.LATE
            return None
        self.delivered += 1
        named = self._names.name(data)
        return MarkerFrame(
            number=data.number,
            time_s=self._increasing(self._time_s(data, received_s)),
            received_s=received_s,
            layout=named.layout,
            positions=named.positions * self.metres,
            unlabelled=named.unlabelled * self.metres,
        )

    def _time_s(self, data: FrameOfData, received_s: float) -> float:
        """Instant of the exposure on the local clock [s], as well as the server tells it."""
        for time_s in (self._exposure_s(data, received_s), self._stamped_s(data, received_s)):
            if received_s - _PLAUSIBLE_S <= time_s:
                return min(time_s, received_s)
        return received_s

    def _exposure_s(self, data: FrameOfData, received_s: float) -> float:
        """By the clock of the cameras; NaN where a server has none, or plays back and leaves the stamp empty."""
        clock = self._echo_clock
        if data.ticks is None or data.ticks.mid_exposure == 0 or clock is None:
            return math.nan
        if clock.synchronised:
            return clock.local_s(data.ticks.mid_exposure)
        return self._tick_clock.local_s(clock.seconds(data.ticks.mid_exposure), received_s)

    def _stamped_s(self, data: FrameOfData, received_s: float) -> float:
        if data.timestamp_s is None or not math.isfinite(data.timestamp_s):
            return math.nan
        return self._stamp_clock.local_s(data.timestamp_s, received_s)

    def _increasing(self, time_s: float) -> float:
        """Frames are told in order: what the clock learns meanwhile must not turn the time back."""
        self._last_s = max(time_s, self._last_s + _TICK_S)
        return self._last_s
