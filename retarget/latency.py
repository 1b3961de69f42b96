"""How long frames take, kept in bounded memory over a run of any length."""

from __future__ import annotations

import math

import numpy as np

_LOWEST_S, _PER_DECADE, _DECADES = 1e-6, 115, 8  # 1 us to 100 s in steps of 2 %


class LatencyHistogram:
    """Counts durations in logarithmic bins; its percentiles are true to 2 %."""

    def __init__(self) -> None:
        self._counts = np.zeros(_PER_DECADE * _DECADES, dtype=np.int64)

    def add(self, duration_s: float) -> None:
        """Count one duration [s]."""
        decades = math.log10(max(duration_s, _LOWEST_S) / _LOWEST_S)
        self._counts[min(int(decades * _PER_DECADE), len(self._counts) - 1)] += 1

    def percentile_ms(self, percent: float) -> float:
        """The duration that `percent` of the frames stay below [ms]; NaN before the first."""
        total = int(self._counts.sum())
        if total == 0:
            return math.nan
        index = int(np.searchsorted(np.cumsum(self._counts), percent / 100 * total))
        return float(1e3 * _LOWEST_S * 10 ** ((index + 0.5) / _PER_DECADE))
