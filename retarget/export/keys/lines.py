"""Multi-line fitting: the keys of a polyline that stays within a tolerance of every recorded key.

Splits at the key with the largest error, as Ramer (1972) and Douglas and Peucker (1973), but with the error measured
at the key's own time, as an animation is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.export.keys.distance import euclidean

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.export.keys.distance import Distance

    Array = NDArray[np.float64]


def line_keys(times_s: Array, values: Array, tolerance: float, distance: Distance = euclidean) -> NDArray[np.intp]:
    """Indices of the keys to keep of `times_s` (N,), rising, and `values` (N, C), N at least 1.

    Every other key lies within `tolerance`, in the unit of `distance`, of the straight line between its neighbours.
    """
    last = len(times_s) - 1
    keep = {0, last}
    spans = [(0, last)]
    while spans:
        start, end = spans.pop()
        if end - start < 2:
            continue
        part = ((times_s[start + 1 : end] - times_s[start]) / (times_s[end] - times_s[start]))[:, None]
        line = values[start] + part * (values[end] - values[start])
        errors = distance(line, values[start + 1 : end])
        worst = int(np.argmax(errors))
        if errors[worst] > tolerance:
            split = start + 1 + worst
            keep.add(split)
            spans += [(start, split), (split, end)]
    return np.array(sorted(keep), np.intp)
