"""What the jaw does beside opening: it slides forward, to the left and to the right, each measured apart.

In the plane across the hinge a chin that is pushed forward by f and turned by theta stands at v = R(theta) (u + f z),
with u its lever at rest and z forward: |v|^2 = |u|^2 + 2 f u_z + f^2 gives f, and what is left of the angle is the
turn. Along the hinge the way is the slide to the side. Metres, radians, ``head``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.rolling import rolling_median
from retarget.rig.jaw import signed_angle

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

FORWARD = np.array([0.0, 0.0, 1.0])
CLOSED = 0.3
"""Slides are read while the jaw is open by less than this part of its opening: farther on, skin that stretches over the
chin looks like one."""
LASTING = 0.99


@dataclass(frozen=True, slots=True, eq=False)
class JawMotion:
    """The jaw in every frame of a recording, (T,) each; NaN where the chin was not seen."""

    turn_rad: Array
    """About the hinge, slides taken out."""
    read_rad: Array
    """About the hinge, as `retarget.rig.jaw` reads it when it runs."""
    forward_m: Array
    left_m: Array


@dataclass(frozen=True, slots=True, eq=False)
class Slides:
    """How far the jaw slid while the mouth was nearly closed [m]; 0 where it did not."""

    forward_m: float
    left_m: float
    right_m: float


def jaw_motion(rest: Array, path: Array, axis: Array, pivot: Array, half: int) -> JawMotion:
    """Turn and slides of the chin's markers at `rest` (N, 3) along their `path` (T, N, 3); `half` frames of median."""
    read = signed_angle(rest - pivot, path - pivot, axis)
    seen = np.isfinite(path.sum(axis=2))
    count = np.where(seen.any(axis=1), seen.sum(axis=1), np.nan)[:, None]
    u = np.where(seen[..., None], rest - pivot, 0.0).sum(axis=1) / count  # of the markers seen, so that none tips it
    v = np.where(seen[..., None], path - pivot, 0.0).sum(axis=1) / count
    forward = FORWARD - (FORWARD @ axis) * axis
    across_u, across_v = (p - np.outer(p @ axis, axis) for p in (u, v))
    reach = across_u @ forward
    more = (across_v**2).sum(axis=1) - (across_u**2).sum(axis=1)
    f = -reach + np.sqrt(np.maximum(reach**2 + more, 0.0))
    pushed = across_u + f[:, None] * forward
    turn = signed_angle(pushed[:, None], across_v[:, None], axis)
    return JawMotion(*(rolling_median(a, half) for a in (turn, read, f, (v - u) @ axis)))


def slides(motion: JawMotion, opening_rad: float) -> Slides:
    """The largest slides that last, of the frames in which the mouth is nearly closed."""
    closed = np.abs(motion.turn_rad) < CLOSED * max(opening_rad, 1e-3)
    if not closed.any():
        return Slides(0.0, 0.0, 0.0)
    sideways = motion.left_m[closed]
    return Slides(
        forward_m=max(float(np.quantile(motion.forward_m[closed], LASTING)), 0.0),
        left_m=max(float(np.quantile(sideways, LASTING)), 0.0),
        right_m=max(float(-np.quantile(sideways, 1 - LASTING)), 0.0),
    )
