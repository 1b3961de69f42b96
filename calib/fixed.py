"""Values that a person has set by hand in a performer file, carried over into a new calibration."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from retarget.performer import DIRECTIONS, gain_matrix

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.performer import Performer, PerformerJaw

    Array = NDArray[np.float64]

JAW_FIELDS = {"min_deg": "min_rad", "max_deg": "max_rad"}
"""Keys of the file that the value calls otherwise."""


def with_fixed(performer: Performer, previous: Performer) -> Performer:
    """`performer` with every value that `previous` calls fixed, and its list of them."""
    K = dict(performer.K)
    jaw, scale = performer.jaw, performer.scale
    for name in previous.fixed:
        kind, _, rest = name.partition(".")
        site, _, direction = rest.partition(".")
        if kind == "K" and site in previous.K:
            K[site] = previous.K[site] if not direction else _one_direction(K.get(site), previous.K[site], direction)
        elif kind == "jaw" and jaw and previous.jaw:
            jaw = _jaw_with(jaw, previous.jaw, rest)
        elif kind == "scale":
            scale = previous.scale
    return replace(performer, K=K, jaw=jaw, scale=scale, fixed=previous.fixed)


def _jaw_with(jaw: PerformerJaw, previous: PerformerJaw, key: str) -> PerformerJaw:
    field = JAW_FIELDS.get(key, key)
    return replace(jaw, **{field: getattr(previous, field)})


def _one_direction(new: Array | None, old: Array, direction: str) -> Array:
    """`new` with what `old` has in one direction of one axis."""
    factors = by_direction(old if new is None else new).copy()
    for axis, names in enumerate(DIRECTIONS):
        if direction in names:
            factors[names.index(direction), axis] = by_direction(old)[names.index(direction), axis]
    return gain_matrix(factors)


def by_direction(K: Array) -> Array:
    """(2, 3) factors of a K, (3, 3) or (2, 3, 3); what a whole matrix has beside its diagonal is left out."""
    return np.diagonal(K if K.ndim == 3 else np.stack([K, K]), axis1=1, axis2=2)
