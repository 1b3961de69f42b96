"""What all filters share: their form, how they count time, and what they make of missing values.

A filter takes one sample of N independent signals (N,) and its time [s], and gives the smoothed sample (N,). A signal
that is NaN, and a sample that is no later than the one before (a doubled packet), leave the output as it was; the time
they took counts once the signal is back. A signal not seen yet is NaN. `reset()` forgets everything.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


class Filter(Protocol):
    """A smoother of N signals."""

    def __call__(self, values: Array, time_s: float, /) -> Array:
        """The smoothed sample (N,) of `values` (N,) at `time_s`; a new array."""
        ...

    def reset(self) -> None:
        """Start anew."""
        ...


class Clock:
    """When each of N signals was last seen."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget it."""
        self._seen_s: Array | None = None
        self._now_s = -np.inf

    def steps(self, values: Array, time_s: float) -> Array:
        """(N,) seconds since each signal of `values` (N,) was last seen, and note that it is seen now.

        NaN where there is nothing new: the value is NaN, or the time is not later. Infinite at first sight.
        """
        if self._seen_s is None:
            self._seen_s = np.full(len(values), -np.inf)
        steps = time_s - self._seen_s
        self._now_s = max(self._now_s, time_s)
        new = np.isfinite(values) & (steps > 0)
        self._seen_s = np.where(new, time_s, self._seen_s)
        return np.where(new, steps, np.nan)

    def see(self, where: NDArray[np.bool_]) -> None:
        """The signals `where` (N,) count as seen in the sample asked for last."""
        if self._seen_s is not None:
            self._seen_s = np.where(where, self._now_s, self._seen_s)
