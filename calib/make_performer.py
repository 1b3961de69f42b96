"""The performer out of what was fitted: neutral in the head's new axes, K within its bounds, the jaw.

Metres, radians, ``head``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from calib.hinge import LEAST_OPENING_RAD
from calib.jaw import jaw_gain, widest
from retarget.performer import gain_matrix

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from calib.face import FaceSites
    from calib.gains import Gains
    from calib.jaw import JawFit
    from calib.matching import Match
    from calib.rig_range import RigRange
    from retarget.performer import Performer, PerformerJaw

    Array = NDArray[np.float64]

DECIMALS = 4
"""Of factors: as many as mean something, and as a person likes to read."""


@dataclass(frozen=True, slots=True, eq=False)
class HeadTurn:
    """Points and vectors in the head's new axes; the turn is about the middle of the face, which stays in place."""

    R: Array
    about: Array

    def points(self, p: Array) -> Array:
        """`p` (..., 3) in the new axes."""
        turned: Array = (p - self.about) @ self.R.T + self.about
        return turned

    def points_before(self, p: Array) -> Array:
        """The reverse of `points`."""
        before: Array = (p - self.about) @ self.R + self.about
        return before


def make_performer(
    default: Performer,
    turned: HeadTurn,
    face: FaceSites,
    gains: Gains,
    jaw: JawFit | None,
    rig_range: RigRange,
    matches: Sequence[Match],
    bounds: tuple[float, float],
) -> tuple[Performer, float | None]:
    """The performer in the new axes, and the jaw's gain before its bounds."""
    low, high = (bound * default.scale for bound in bounds)
    K = {site: gain_matrix(_brief(gains.K[:, s].clip(low, high).round(DECIMALS))) for s, site in enumerate(face.names)}
    fitted, wanted = _performer_jaw(default, turned, jaw, rig_range, matches, bounds)
    return replace(default, neutral=turned.points(default.neutral), K=K, jaw=fitted), wanted


def _brief(K: Array) -> Array:
    """(2, 3), or (3,) where both directions are one."""
    return K[0] if np.allclose(K[0], K[1], rtol=1e-3) else K


def _performer_jaw(
    default: Performer,
    turned: HeadTurn,
    jaw: JawFit | None,
    rig_range: RigRange,
    matches: Sequence[Match],
    bounds: tuple[float, float],
) -> tuple[PerformerJaw | None, float | None]:
    if jaw is None or default.jaw is None or rig_range.rig.jaw is None:
        return default.jaw, None
    fitted = replace(
        default.jaw,
        axis=turned.R @ jaw.axis,
        pivot=turned.points(jaw.pivot),
        forward_m=jaw.slides.forward_m,
        left_m=jaw.slides.left_m,
        right_m=jaw.slides.right_m,
    )
    opened = next((m for m in matches if m.name == "jawOpen" and not m.side and m.exercised), None)
    opening = opened.turn_rad if opened else (jaw.hinge.opening_rad if jaw.hinge else np.nan)
    if jaw.hinge is None and (opened is None or opening < LEAST_OPENING_RAD):
        return fitted, None
    gain, wanted = jaw_gain(opening, rig_range.jaw_rad, bounds)
    limit = widest(gain, jaw.opening_rad, rig_range.rig.jaw.max_rad)
    return replace(fitted, gain=round(gain, DECIMALS), max_rad=max(limit, rig_range.rig.jaw.min_rad, 0.0)), wanted
