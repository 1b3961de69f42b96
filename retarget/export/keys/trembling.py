"""Trembling reduction: a key that turns back faster than a body can is dropped.

The rule of Video2Anim: of three recorded keys in a row, the middle one goes where it is an extremum and the outer two
lie no further apart than the period of `min_freq_hz`. At twice that rate or more, every extremum goes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def steady_keys(times_s: Array, values: Array, min_freq_hz: float) -> NDArray[np.intp]:
    """Indices of the keys that stay, of `times_s` (N,) and `values` (N,); all of them where `min_freq_hz` is 0.

    The first and the last key stay. A key is compared with its neighbours as recorded, whether they stay or not.
    """
    stays = np.ones(len(times_s), bool)
    if min_freq_hz > 0 and len(times_s) > 2:
        rises = np.diff(values) > 0
        quick = times_s[2:] - times_s[:-2] <= 1 / min_freq_hz
        stays[1:-1] = ~(quick & (rises[:-1] != rises[1:]))
    return np.flatnonzero(stays)
