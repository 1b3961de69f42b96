"""Slopes of a smooth curve through its keys: that of the line between the neighbours, and none at both ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.export.keys.curve import Curve

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def central_slopes(times_s: Array, values: Array) -> Array:
    """Slopes (K, C) at keys `times_s` (K,), rising, and `values` (K, C): (next - previous) / their time apart."""
    slopes = np.zeros_like(values)
    slopes[1:-1] = (values[2:] - values[:-2]) / (times_s[2:] - times_s[:-2])[:, None]
    return slopes


def smooth_curve(times_s: Array, values: Array) -> Curve:
    """The curve through keys `times_s` (K,), `values` (K, C) with `central_slopes`, the same on both sides."""
    slopes = central_slopes(times_s, values)
    return Curve(times_s, values, slopes, slopes)
