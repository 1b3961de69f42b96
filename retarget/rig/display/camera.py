"""Where the camera stands so that the face, the head or the bust fills the picture.

Frame ``camera`` is OpenGL's: +X to the right of the picture, +Y up, looking along -Z. Lengths in metres, frame ``rig``
at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.geometry import matrix_from_quat, quat_from_axis_angle, quat_multiply, transform

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.rig.display.view import View
    from retarget.rig.model import Rig

    Array = NDArray[np.float64]

FIELD_OF_VIEW_RAD = np.deg2rad(20.0)
"""Of the picture's shorter side: a portrait lens, which does not swell the nose."""

MARGINS = {"face": 1.2, "head": 1.06, "bust": 1.06}
"""How much larger the picture is than what it must show."""

BUST = 0.75
"""How far below the head a bust reaches, in heights of the head."""

CHIN_DROP = 0.1
"""How far a wide open mouth takes the chin below its rest, in heights of the head."""


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A perspective camera and the slab of space that it must show."""

    T_rig_camera: NDArray[np.float64]
    """(4, 4)"""
    yfov_rad: float
    """Between the lower and the upper edge of the picture."""
    near: float
    far: float


def camera_for(rig: Rig, view: View) -> Camera:
    """The camera that shows what `view` asks of the rig at rest."""
    points = subject(rig, view)
    target = (points.min(axis=0) + points.max(axis=0)) / 2
    turn = quat_multiply(
        quat_from_axis_angle([0.0, 1.0, 0.0], view.yaw_rad), quat_from_axis_angle([1.0, 0.0, 0.0], -view.pitch_rad)
    )
    R_rig_camera = matrix_from_quat(turn)
    tangents = _half_tangents(view)
    distance = _distance(points - target, R_rig_camera, tangents / MARGINS[view.framing]) / view.zoom
    reach = float(np.linalg.norm(_all_points(rig) - target, axis=1).max()) * 1.5
    T_rig_camera = transform(R_rig_camera, target + distance * R_rig_camera[:, 2])
    near = max(distance - reach, distance * 0.02)
    return Camera(T_rig_camera, 2 * float(np.arctan(tangents[1])), near, distance + reach)


def subject(rig: Rig, view: View) -> Array:
    """The points (N, 3) [m], ``rig``, that the picture must hold, from the rig at rest."""
    if view.framing == "face" and rig.sites:
        sites: Array = np.stack([site.rest for site in rig.sites.values()])
        return _with_open_mouth(sites + rig.joints.T_rig_joint[rig.head_joint, :3, 3])
    points, on_head = _all_points(rig), _on_head(rig)
    if not on_head.any():
        return points
    head: Array = points[on_head]
    if view.framing != "bust":
        return _with_open_mouth(head)
    lower, upper = head[:, 1].min(), head[:, 1].max()
    bust: Array = points[points[:, 1] > lower - BUST * (upper - lower)]
    return bust


def _with_open_mouth(points: Array) -> Array:
    """The points and one more, where the chin goes."""
    lowest = points[np.argmin(points[:, 1])]
    drop = CHIN_DROP * (points[:, 1].max() - lowest[1])
    return np.vstack([points, lowest - [0.0, drop, 0.0]])


def _all_points(rig: Rig) -> Array:
    points: Array = np.concatenate([surface.positions for surface in rig.surfaces], dtype=float)
    return points


def _on_head(rig: Rig) -> NDArray[np.bool_]:
    """(N,): which of all points follow the head, or a joint below it, for more than a half."""
    joints = np.zeros(len(rig.joints.names), bool)
    for i, parent in enumerate(rig.joints.parents):
        joints[i] = i == rig.head_joint or (parent >= 0 and joints[parent])
    shares = [np.where(joints[s.joints], s.joint_weights, 0.0).sum(axis=1) for s in rig.surfaces]
    return np.concatenate(shares) > 0.5


def _half_tangents(view: View) -> Array:
    """Half the picture's width and height at unit distance, (2,)."""
    size = np.array([view.width, view.height], float)
    return np.asarray(np.tan(FIELD_OF_VIEW_RAD / 2) * size / size.min())


def _distance(offsets: Array, R_rig_camera: Array, tangents: Array) -> float:
    """The least distance from the target at which every offset (N, 3), ``rig``, is inside the picture."""
    in_camera = offsets @ R_rig_camera
    return float((np.abs(in_camera[:, :2]) / tangents + in_camera[:, 2:]).max())
