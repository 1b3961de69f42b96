"""A curve of keys, and its value between them: the cubic Hermite that Unity and glTF (CUBICSPLINE) evaluate.

Times in seconds; values in whatever unit the channel has; slopes in that unit per second. glTF 2.0, appendix C.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """Keys of one channel of C components; arriving and leaving slope of a key may differ."""

    times_s: Array
    """(K,), rising; at least one."""
    values: Array
    """(K, C)."""
    in_slopes: Array
    """(K, C), with which the curve arrives."""
    out_slopes: Array
    """(K, C), with which the curve leaves."""

    def __call__(self, times_s: ArrayLike) -> Array:
        """Values (N, C) at `times_s` (N,); before the first and after the last key the curve stands still. NaN
        times give NaN values. A quaternion comes back as the program interpolates it, not yet of unit length.
        """
        t = np.clip(np.asarray(times_s, float), self.times_s[0], self.times_s[-1])
        if len(self.times_s) == 1:
            return np.where(np.isnan(t)[:, None], np.nan, self.values[[0]])
        key = np.clip(np.searchsorted(self.times_s, t, side="right") - 1, 0, len(self.times_s) - 2)
        length = self.times_s[key + 1] - self.times_s[key]
        h00, h10, h01, h11 = hermite_basis((t - self.times_s[key]) / length)
        value: Array = (
            h00[:, None] * self.values[key]
            + (length * h10)[:, None] * self.out_slopes[key]
            + h01[:, None] * self.values[key + 1]
            + (length * h11)[:, None] * self.in_slopes[key + 1]
        )
        return value


def hermite_basis(u: Array) -> tuple[Array, Array, Array, Array]:
    """Weights of start value, start slope, end value and end slope at `u` in [0, 1]; slopes per unit of u."""
    past = 1 - u
    return (1 + 2 * u) * past * past, u * past * past, u * u * (3 - 2 * u), -u * u * past
