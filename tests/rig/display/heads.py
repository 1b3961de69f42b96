"""A head of simple solids whose picture can be foretold, and the poses that move it.

The skin is an ellipsoid of 0.10 x 0.13 x 0.11 m about (0, 1.6, 0), ``rig``, with a bump for a nose at +Z; a red ball
stands off its left, +X.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from retarget.frames import Pose
from retarget.geometry import quat_from_axis_angle, transform
from retarget.rig.model import Joints, Material, Rig, Shape, Site, Surface

if TYPE_CHECKING:
    from numpy.typing import NDArray

CENTRE = np.array([0.0, 1.6, 0.0])
RADII = np.array([0.10, 0.13, 0.11])
SKIN_COLOR = (0.6, 0.36, 0.26, 1.0)


def ball(rows: int = 24, columns: int = 48) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Points (V, 3) of the unit ball and its triangles (F, 3), counter-clockwise from outside; the seam is behind."""
    latitude = np.linspace(np.pi / 2, -np.pi / 2, rows + 1)[:, None]
    longitude = np.linspace(-np.pi, np.pi, columns + 1)[None, :]
    parts = (
        np.cos(latitude) * np.sin(longitude),
        np.sin(latitude) + 0 * longitude,
        np.cos(latitude) * np.cos(longitude),
    )
    points = np.stack(parts, axis=-1).reshape(-1, 3)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    upper, lower = i * (columns + 1) + j, (i + 1) * (columns + 1) + j
    triangles = np.concatenate([np.stack([upper, lower, lower + 1], 1), np.stack([upper, lower + 1, upper + 1], 1)])
    return points, triangles.astype(np.int32)


def ball_uv(rows: int = 24, columns: int = 48) -> NDArray[np.float32]:
    """(V, 2) for `ball`: u from the character's right at 0 to his left at 1, v from the crown at 0 to the neck at 1."""
    v, u = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
    return np.stack([u, v], axis=-1).reshape(-1, 2).astype(np.float32)


def head_rig(skin: Material | None = None) -> Rig:
    """The whole head with one blend shape that pulls the chin down; `skin` replaces the plain skin."""
    points, triangles = ball()
    nose = np.exp(-((points - [0, 0, 1]) ** 2).sum(axis=1) / 0.02)[:, None] * [0, 0, 0.03]
    positions = (points * RADII + CENTRE + nose).astype(np.float32)
    chin = np.flatnonzero((points[:, 1] < -0.5) & (points[:, 2] > 0))
    shape = Shape(chin, np.tile(np.array([0, -0.05, 0], np.float32), (len(chin), 1)))
    material = skin or Material(base_color=SKIN_COLOR)
    face = _on_head("skin", positions, points / RADII, triangles, material, (shape,))
    face = replace(face, uv=ball_uv())
    mark = (points * 0.012 + CENTRE + [0.06, 0.03, 0.11]).astype(np.float32)
    nothing = Shape(np.empty(0, np.intp), np.empty((0, 3), np.float32))
    ear = _on_head("mark", mark, points, triangles, Material(base_color=(0.8, 0.0, 0.0, 1.0)), (nothing,))
    return Rig("ball head", Path("ball.glb"), _joints(), (face, ear), ("chinDown",), _sites(), 1, 0, (None, None), None)


def head_pose(rig: Rig, yaw_rad: float = 0.0, chin: float = 0.0, number: int = 0) -> Pose:
    """The head turned to its left by `yaw_rad`, the chin down by `chin` in [0, 1]."""
    rotations = rig.joints.rotations.copy()
    rotations[rig.head_joint] = quat_from_axis_angle([0.0, 1.0, 0.0], yaw_rad)
    return Pose(
        number, number / 60, number / 60, np.eye(4), rig.joints.translations.copy(), rotations, np.array([chin])
    )


def _on_head(
    name: str,
    positions: NDArray[np.float32],
    normals: NDArray[np.float64],
    triangles: NDArray[np.int32],
    material: Material,
    shapes: tuple[Shape, ...],
) -> Surface:
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    joints, weights = np.ones((len(positions), 1), np.intp), np.ones((len(positions), 1), np.float32)
    return Surface(name, positions, normals.astype(np.float32), triangles, joints, weights, shapes, material)


def _joints() -> Joints:
    translations = np.array([[0.0, 1.4, 0.0], [0.0, 0.1, 0.0]])
    T_rig_joint = transform(np.eye(3), np.cumsum(translations, axis=0))
    T_joint_mesh = transform(np.eye(3), -np.cumsum(translations, axis=0))
    return Joints(
        ("neck", "head"),
        np.array([-1, 0]),
        translations,
        np.tile([0.0, 0.0, 0.0, 1.0], (2, 1)),
        T_rig_joint,
        T_joint_mesh,
    )


def _sites() -> dict[str, Site]:
    places = {
        "forehead": [0.0, 0.17, 0.10],
        "chin": [0.0, 0.02, 0.09],
        "cheekOuterLeft": [0.08, 0.1, 0.06],
        "cheekOuterRight": [-0.08, 0.1, 0.06],
    }
    return {name: Site(name, 1, rides_jaw=False, rest=np.array(place)) for name, place in places.items()}
