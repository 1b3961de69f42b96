"""Filters over the frames of a recording, for all markers at once; NaN is a gap and never spreads.

Arrays are (T, ...), time first; a window of half width k spans 2 k + 1 frames and is shorter at both ends. Offline, so
the windows look ahead.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

SPARE_M = 0.002
"""How far from its neighbours in time a marker may be before its own spread is asked [m]."""
SPREADS = 4.0
MAD_TO_SIGMA = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution."""


def rolling_median(values: Array, half: int) -> Array:
    """Median over the window, of what is seen in it; NaN where nothing is."""
    flat = values.reshape(len(values), -1)
    gap = np.full((half, flat.shape[1]), np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(np.vstack([gap, flat, gap]), 2 * half + 1, axis=0)
    ordered = np.sort(windows, axis=-1)  # NaN goes last
    seen = np.isfinite(ordered).sum(axis=-1)
    last = np.maximum(seen - 1, 0)
    lower, upper = (np.take_along_axis(ordered, i[..., None], -1)[..., 0] for i in (last // 2, (last + 1) // 2))
    median: Array = (0.5 * (lower + upper)).reshape(values.shape)
    return median


def rolling_mean(values: Array, half: int) -> Array:
    """Mean over the window, of what is seen in it; NaN where nothing is."""
    sums, seen = window_sums(values, half)
    return np.where(seen > 0, sums / np.maximum(seen, 1), np.nan)


def window_sums(values: Array, half: int) -> tuple[Array, Array]:
    """Sum over the window of what is seen in it, and how many frames that is; both of the shape of `values`."""
    known = np.isfinite(values)
    return _sums(np.where(known, values, 0.0), half), _sums(known.astype(float), half)


def _sums(values: Array, half: int) -> Array:
    total = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
    index = np.arange(len(values))
    sums: Array = total[np.minimum(index + half + 1, len(values))] - total[np.maximum(index - half, 0)]
    return sums


def without_spikes(positions: Array, half: int = 4) -> Array:
    """(T, M, 3) with NaN for every sample that leaves its neighbours in time for a moment (Hampel 1974).

    A sample goes when it is off the running median by `SPARE_M` and `SPREADS` of the window's own spread.
    """
    off = np.linalg.norm(positions - rolling_median(positions, half), axis=2)
    spread = MAD_TO_SIGMA * rolling_median(off, half)
    return np.where((off > SPARE_M + SPREADS * spread)[..., None], np.nan, positions)
