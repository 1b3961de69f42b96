"""Means over the recent past: exponential, or over a span of time."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError
from retarget.filters.filter import Clock

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


class ExponentialMean:
    """A `Filter`: after `time_constant_s` 63 % of the way to a new value is gone, at any frame rate."""

    def __init__(self, time_constant_s: float) -> None:
        """InputError where the time is not above 0."""
        if not time_constant_s > 0:
            raise InputError(f"The time constant of a mean must be above 0 s; it is {time_constant_s:g} s.")
        self._time_constant_s = time_constant_s
        self._clock = Clock()
        self.reset()

    @classmethod
    def of_gain(cls, gain: float, rate_hz: float) -> ExponentialMean:
        """The one that goes `gain` of the way in one sample of a stream at `rate_hz`, 0 < gain < 1."""
        if not 0 < gain < 1:
            raise InputError(f"The gain of a mean must be between 0 and 1; it is {gain:g}.")
        return cls(-1 / (rate_hz * math.log1p(-gain)))

    def reset(self) -> None:
        """As `Filter`."""
        self._clock.reset()
        self._value = np.zeros(0)

    def __call__(self, values: Array, time_s: float) -> Array:
        """As `Filter`."""
        steps = self._clock.steps(values, time_s)
        if len(self._value) != len(values):
            self._value = values.copy()
        gain = -np.expm1(-steps / self._time_constant_s)  # 1 at first sight, NaN where there is nothing new
        before = np.where(np.isinf(steps), values, self._value)
        self._value = np.where(np.isnan(steps), self._value, before + gain * (values - before))
        return self._value.copy()


class MovingMean:
    """A `Filter`: the mean of the samples of the last `span_s`, the newest always among them."""

    def __init__(self, span_s: float) -> None:
        """InputError where the span is not above 0."""
        if not span_s > 0:
            raise InputError(f"The span of a moving mean must be above 0 s; it is {span_s:g} s.")
        self._span_s = span_s
        self.reset()

    def reset(self) -> None:
        """As `Filter`."""
        self._samples: deque[tuple[float, Array]] = deque()
        self._value = np.zeros(0)

    def __call__(self, values: Array, time_s: float) -> Array:
        """As `Filter`."""
        if not self._samples or time_s > self._samples[-1][0]:
            self._samples.append((time_s, values.copy()))
        while self._samples[0][0] < self._samples[-1][0] - self._span_s:
            self._samples.popleft()
        mean = _mean([sample for _, sample in self._samples])
        self._value = np.where(np.isnan(mean), self._value if len(self._value) else mean, mean)
        return self._value.copy()


def _mean(samples: list[Array]) -> Array:
    """The mean of those that are not NaN; NaN where all are."""
    stacked = np.array(samples)
    count = np.isfinite(stacked).sum(axis=0)
    return np.where(count > 0, np.nansum(stacked, axis=0) / np.maximum(count, 1), np.nan)
