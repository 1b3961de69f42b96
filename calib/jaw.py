"""The performer's jaw out of the chin's path: hinge, gain, limits and slides; the rig's where the take does not tell.

Metres, radians, ``head``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.hinge import Hinge, HingeNotObservableError, fit_hinge
from calib.protrusion import JawMotion, Slides, jaw_motion, slides

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.performer import PerformerJaw

    Array = NDArray[np.float64]

MEDIAN_S = 0.04
BEYOND = 1.15
"""The jaw may open by this much more than it was seen to, as nobody opens widest when asked."""


@dataclass(frozen=True, slots=True, eq=False)
class JawFit:
    """The jaw as it was seen."""

    axis: Array
    pivot: Array
    hinge: Hinge | None
    """None where axis and pivot are those that were there before."""
    complaint: str
    """Why the hinge could not be fitted; "" where it could."""
    motion: JawMotion
    slides: Slides

    @property
    def opening_rad(self) -> float:
        """Largest lasting turn; 0 where the chin was never seen."""
        turns = self.motion.turn_rad[np.isfinite(self.motion.turn_rad)]
        return float(np.quantile(turns, 0.995)) if turns.size else 0.0


def fit_jaw(rest: Array, path: Array, rate_hz: float, default: PerformerJaw, fixed: frozenset[str]) -> JawFit:
    """The jaw out of the chin's markers at `rest` (N, 3), on their `path` (T, N, 3).

    `default` is the rig's hinge at the performer's size, or one that a person has fixed ("jaw.axis", "jaw.pivot").
    """
    hinge, complaint = None, ""
    axis, pivot = default.axis, default.pivot
    if not {"jaw.axis", "jaw.pivot"} <= fixed:
        try:
            hinge = fit_hinge(rest, path, rate_hz, axis, pivot)
        except HingeNotObservableError as error:
            complaint = str(error)
    if hinge:
        axis = axis if "jaw.axis" in fixed else hinge.axis
        pivot = pivot if "jaw.pivot" in fixed else hinge.pivot
    motion = jaw_motion(rest, path, axis, pivot, max(round(MEDIAN_S * rate_hz / 2), 1))
    opening = hinge.opening_rad if hinge else 0.1
    return JawFit(axis, pivot, hinge, complaint, motion, slides(motion, opening))


def jaw_gain(performer_rad: float, rig_rad: float, bounds: tuple[float, float]) -> tuple[float, float]:
    """The gain that takes the performer's full opening to the rig's, within `bounds`, and what it was before them."""
    wanted = rig_rad / performer_rad
    return min(max(wanted, bounds[0]), bounds[1]), wanted


def widest(gain: float, opening_rad: float, rig_max_rad: float) -> float:
    """The limit of the rig's turn for this performer [rad]."""
    return min(rig_max_rad, max(BEYOND * gain * opening_rad, 0.0))
