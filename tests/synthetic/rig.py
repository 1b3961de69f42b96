"""A rig of joints alone, in memory: a neck, a head, a jaw, two eyes and a facial joint at each of the 41 sites.

Fast to make and free of files. Frame ``rig`` and metres as in `retarget.rig.model`; the places are those of a typical
adult, to some millimetres.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from retarget import geometry
from retarget.rig.model import Jaw, Joints, Rig, Site

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

HEAD_RIG = np.array([0.0, 1.6, 0.02])
NECK_RIG = np.array([0.0, 1.5, -0.01])
JAW_PIVOT = (0.0, 0.06, 0.01)
EYE_LEFT = (0.032, 0.09, 0.068)
MIDDLE = {
    "forehead": (0.0, 0.155, 0.09),
    "browCenter": (0.0, 0.113, 0.099),
    "noseBridge": (0.0, 0.09, 0.1),
    "noseTip": (0.0, 0.06, 0.122),
    "lipUpper": (0.0, 0.035, 0.105),
    "lipLower": (0.0, 0.012, 0.102),
    "chin": (0.0, -0.015, 0.09),
}
LEFT = {
    "forehead": (0.035, 0.15, 0.082),
    "browInner": (0.015, 0.115, 0.095),
    "browMid": (0.035, 0.12, 0.085),
    "browOuter": (0.055, 0.11, 0.065),
    "noseWing": (0.018, 0.055, 0.1),
    "lidUpper": (0.032, 0.098, 0.083),
    "lidLower": (0.032, 0.082, 0.081),
    "eyeInner": (0.017, 0.089, 0.08),
    "eyeOuter": (0.048, 0.09, 0.07),
    "cheekUpper": (0.045, 0.055, 0.075),
    "cheekLower": (0.045, 0.025, 0.065),
    "cheekOuter": (0.062, 0.055, 0.045),
    "lipUpper": (0.015, 0.033, 0.1),
    "lipCorner": (0.028, 0.022, 0.085),
    "lipLower": (0.015, 0.013, 0.096),
    "chin": (0.02, -0.012, 0.083),
    "mandible": (0.05, 0.0, 0.045),
}
MIRROR = np.array([-1.0, 1.0, 1.0])
RIDERS = ("lipLower", "chin", "mandible")


def site_rests() -> dict[str, Array]:
    """Place of each of the 41 sites, (3,) [m], ``head``."""
    left = {f"{name}Left": np.array(p) for name, p in LEFT.items()}
    right = {f"{name}Right": p * MIRROR for name, p in zip(LEFT, left.values(), strict=True)}
    return {name: np.array(p) for name, p in MIDDLE.items()} | left | right


def small_rig(axes: Literal["plain", "turned"] = "plain") -> Rig:
    """The rig; "turned" gives every joint axes of its own at rest, as rigs out of animation programs have them."""
    rests = site_rests()
    names = ("neck", "head", "jaw", "eyeLeft", "eyeRight", *rests)
    riders = [name for name in rests if name.startswith(RIDERS)]
    parents = np.array([-1, 0, 1, 1, 1, *(names.index("jaw") if n in riders else 1 for n in rests)], np.intp)
    in_head = [JAW_PIVOT, EYE_LEFT, np.array(EYE_LEFT) * MIRROR, *rests.values()]
    p_rig = np.vstack([NECK_RIG, HEAD_RIG, HEAD_RIG + np.array(in_head)])
    axis = np.array([1.0, 0.0, 0.0])
    return Rig(
        name="small",
        path=Path("small/rig.toml"),
        joints=_joints(names, parents, p_rig, _rest_rotations(len(names), axes)),
        surfaces=(),
        shape_names=("jawOpen", "mouthSmileLeft"),
        sites={name: Site(name, names.index(name), name in riders, p) for name, p in rests.items()},
        head_joint=1,
        neck_joint=0,
        eye_joints=(3, 4),
        jaw=Jaw(2, axis, np.array(JAW_PIVOT), np.radians(-2.0), np.radians(35.0)),
    )


def _rest_rotations(count: int, axes: Literal["plain", "turned"]) -> Array:
    """R_rig_joint (J, 3, 3)."""
    if axes == "plain":
        return np.tile(np.eye(3), (count, 1, 1))
    quats = np.random.default_rng(7).normal(size=(count, 4))
    return geometry.matrix_from_quat(quats / np.linalg.norm(quats, axis=1, keepdims=True))


def _joints(names: tuple[str, ...], parents: NDArray[np.intp], p_rig: Array, R_rig_joint: Array) -> Joints:
    T_rig_joint = geometry.transform(R_rig_joint, p_rig)
    T_joint_mesh = geometry.inverse(T_rig_joint)
    T_parent_joint = np.where(parents[:, None, None] < 0, T_rig_joint, T_joint_mesh[parents] @ T_rig_joint)
    rotations = geometry.quat_from_matrix(T_parent_joint[:, :3, :3])
    return Joints(names, parents, T_parent_joint[:, :3, 3], rotations, T_rig_joint, T_joint_mesh)
