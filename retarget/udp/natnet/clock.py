"""The sender's clocks mapped to the local monotonic clock.

Two ways. Where the sender answers echo requests (from 3.0), its high-resolution clock is read as in Cristian's
algorithm (F. Cristian, "Probabilistic clock synchronization", 1989): the answer was written between sending and
receiving, so half the round trip bounds the error; the quickest of many round trips count, and a line through them
gives the drift. Else the smallest delay stands for all: the quickest frame of the last half minute is taken to have
come at once.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

_SAMPLES = 120
_SPAN_FOR_DRIFT_S = 10.0
_MAX_DRIFT = 1e-3  # crystals differ by less than 0.0002
_JUMP_S = 0.25
_ASYMMETRY_S = 20e-6  # round trips that differ by less than this are equally good


@dataclass(frozen=True, slots=True)
class EchoSample:
    """One echo: when it was asked and answered by the local clock, and what the sender's clock said between."""

    sent_s: float
    received_s: float
    remote_s: float

    @property
    def round_trip_s(self) -> float:
        """Time from asking to the answer [s]."""
        return self.received_s - self.sent_s

    @property
    def offset_s(self) -> float:
        """Local minus remote clock, true to half the round trip [s]."""
        return 0.5 * (self.sent_s + self.received_s) - self.remote_s


@dataclass(frozen=True, slots=True)
class _Line:
    """Local minus remote clock as a function of the remote clock."""

    remote_s: float
    offset_s: float
    drift: float

    def local(self, remote_s: float) -> float:
        return remote_s + self.offset_s + self.drift * (remote_s - self.remote_s)


class EchoClock:
    """Learns the sender's high-resolution clock from echoes.

    `ticks_per_s` is the frequency that the sender announced; it must be positive.
    """

    def __init__(self, ticks_per_s: int) -> None:
        self._ticks_per_s = ticks_per_s
        self._samples: deque[EchoSample] = deque(maxlen=_SAMPLES)
        self._line: _Line | None = None

    @property
    def synchronised(self) -> bool:
        """Whether an echo was answered yet."""
        return self._line is not None

    @property
    def best_round_trip_s(self) -> float:
        """Quickest echo of the last two minutes [s]; NaN before the first."""
        return min((sample.round_trip_s for sample in self._samples), default=math.nan)

    @property
    def drift(self) -> float:
        """By how much the local clock runs faster than the sender's, 1e-6 is a microsecond a second."""
        return self._line.drift if self._line is not None else 0.0

    def add(self, sent_s: float, received_s: float, ticks: int) -> None:
        """Take an answered echo; a clock that jumped (the sender was restarted) is learnt anew."""
        sample = EchoSample(sent_s, received_s, self.seconds(ticks))
        if sample.round_trip_s < 0.0:
            return
        if self._line is not None and self._contradicts(sample, self._line):
            self._samples.clear()
        self._samples.append(sample)
        self._line = _fitted(self._samples)

    def seconds(self, ticks: int) -> float:
        """The sender's own time [s]."""
        return ticks / self._ticks_per_s

    def local_s(self, ticks: int) -> float:
        """Local monotonic time of an instant of the sender's clock [s]; NaN before the first echo."""
        return self._line.local(self.seconds(ticks)) if self._line is not None else math.nan

    @staticmethod
    def _contradicts(sample: EchoSample, line: _Line) -> bool:
        error_s = abs(line.local(sample.remote_s) - (sample.remote_s + sample.offset_s))
        return error_s > sample.round_trip_s + _JUMP_S


def _fitted(samples: deque[EchoSample]) -> _Line:
    """Line through the samples, each weighted by how tightly its round trip binds the offset.

    The quickest sample alone fixes the height: its offset is the truest there is.
    """
    best = min(samples, key=lambda sample: sample.round_trip_s)
    span_s = samples[-1].remote_s - samples[0].remote_s
    if span_s < _SPAN_FOR_DRIFT_S:
        return _Line(best.remote_s, best.offset_s, 0.0)
    weights = [(_ASYMMETRY_S / (s.round_trip_s - best.round_trip_s + _ASYMMETRY_S)) ** 2 for s in samples]
    total = math.fsum(weights)
    mean_x = math.fsum(w * s.remote_s for w, s in zip(weights, samples, strict=True)) / total
    mean_y = math.fsum(w * s.offset_s for w, s in zip(weights, samples, strict=True)) / total
    spread = math.fsum(w * (s.remote_s - mean_x) ** 2 for w, s in zip(weights, samples, strict=True))
    joint = math.fsum(w * (s.remote_s - mean_x) * (s.offset_s - mean_y) for w, s in zip(weights, samples, strict=True))
    drift = joint / spread if spread > 0.0 else 0.0
    return _Line(mean_x, mean_y, min(max(drift, -_MAX_DRIFT), _MAX_DRIFT))


class DelayClock:
    """Maps time stamps without echoes: local = stamp + the smallest (arrival - stamp) of the last `window_s`.

    Late by the smallest delay of the network, and as steady as the sender's own stamps.
    """

    def __init__(self, window_s: float = 30.0) -> None:
        self._window_s = window_s
        self._previous_s = math.inf
        self._current_s = math.inf
        self._since_s = math.nan
        self._last_stamp_s = -math.inf

    def local_s(self, stamp_s: float, received_s: float) -> float:
        """Local monotonic time of the sender's `stamp_s` [s], never later than `received_s`."""
        offset_s = received_s - stamp_s
        if stamp_s < self._last_stamp_s or offset_s > self._smallest_s() + 1.0:
            self._forget()  # the sender was restarted, rewound, or paused with its clock
        self._last_stamp_s = stamp_s
        if not received_s - self._since_s < self._window_s:
            self._previous_s, self._current_s, self._since_s = self._current_s, math.inf, received_s
        self._current_s = min(self._current_s, offset_s)
        return stamp_s + self._smallest_s()

    def _smallest_s(self) -> float:
        return min(self._previous_s, self._current_s)

    def _forget(self) -> None:
        self._previous_s = self._current_s = math.inf
        self._since_s = math.nan
