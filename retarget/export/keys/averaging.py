"""Key averaging: at most so many keys a second, each the mean of those it stands for (a step of Video2Anim)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

WINDOW_S = 1.0


def average_keys(times_s: Array, values: Array, keys_per_s: int) -> tuple[Array, Array]:
    """Times (K,) and values (K,) with at most `keys_per_s` keys in each window; all as they are where it is 0.

    The first and the last key stay. A window runs from the key before it until more than a second has passed; one
    that holds more keys than allowed becomes `keys_per_s` groups of equal count, the last with what is left over, and
    each group its mean time and value.
    """
    if keys_per_s <= 0 or len(times_s) < 3:
        return times_s, values
    groups = [group for window in _windows(times_s) for group in _groups(window, keys_per_s)]
    starts = np.array([0, *(group.start for group in groups), len(times_s) - 1])
    counts = np.diff(starts, append=len(times_s))
    return np.add.reduceat(times_s, starts) / counts, np.add.reduceat(values, starts) / counts


def _windows(times_s: Array) -> list[range]:
    """The keys between the first and the last, window by window."""
    windows = []
    first = 1
    for key in range(1, len(times_s) - 1):
        if times_s[key] - times_s[first - 1] > WINDOW_S or key == len(times_s) - 2:
            windows.append(range(first, key + 1))
            first = key + 1
    return windows


def _groups(window: range, most: int) -> list[range]:
    if len(window) <= most:
        return [range(key, key + 1) for key in window]
    size = len(window) // most
    starts = [window.start + i * size for i in range(most)]
    return [range(start, end) for start, end in zip(starts, [*starts[1:], window.stop], strict=True)]
