"""Where a pose puts the rig's joints, worked out one by one from the definition: slow, and apart from the solver."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import Pose
    from retarget.rig.model import Rig

    Array = NDArray[np.float64]


def joint_transforms(rig: Rig, pose: Pose) -> Array:
    """T_rig_joint (J, 4, 4) of every joint in this pose."""
    T_rig_joint: list[Array] = []
    for parent, t, q in zip(rig.joints.parents, pose.translations, pose.rotations, strict=True):
        T_parent_joint = geometry.transform(geometry.matrix_from_quat(q), t)
        T_rig_joint.append(T_parent_joint if parent < 0 else T_rig_joint[parent] @ T_parent_joint)
    return np.array(T_rig_joint)


def head_turn(rig: Rig, pose: Pose) -> Array:
    """(3, 3) turn of the rig's head from its rest, in the axes of ``rig``."""
    turn: Array = joint_transforms(rig, pose)[rig.head_joint, :3, :3] @ rig.joints.T_rig_joint[rig.head_joint, :3, :3].T
    return turn


def site_places(rig: Rig, pose: Pose) -> dict[str, Array]:
    """Place of each site's joint (3,) [m], ``head``: the head's own turn is taken out."""
    T_rig_joint = joint_transforms(rig, pose)
    turn, origin = head_turn(rig, pose), T_rig_joint[rig.head_joint, :3, 3]
    return {name: turn.T @ (T_rig_joint[site.joint, :3, 3] - origin) for name, site in rig.sites.items()}
