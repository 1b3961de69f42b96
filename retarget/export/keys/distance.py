"""How far a fitted value is from the recorded one, in the unit of the tolerance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Distance = Callable[[Array, Array], Array]


def euclidean(fitted: Array, recorded: Array) -> Array:
    """Distance (...) of values (..., C), in their unit; of one component, the absolute difference."""
    error = fitted - recorded
    distance: Array = np.sqrt(np.einsum("...c,...c->...", error, error))
    return distance


def angle_deg(fitted: Array, recorded: Array) -> Array:
    """Turn (...) [deg] between `fitted` (..., 4), brought to unit length first as players do, and unit quaternions."""
    length = np.sqrt(np.einsum("...c,...c->...", fitted, fitted))
    unit = fitted / np.maximum(length, 1e-300)[..., None]
    # chords, as the arc cosine loses half the digits of a small angle
    apart = euclidean(unit, recorded)
    together = euclidean(unit, -recorded)
    turn: Array = np.degrees(4 * np.arctan2(np.minimum(apart, together), np.maximum(apart, together)))
    return turn
