"""Poses that need no markers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.frames import Pose

if TYPE_CHECKING:
    from retarget.rig.model import Rig


def rest_pose(rig: Rig) -> Pose:
    """The rig as it was modelled, at time 0: joints at rest, no blend shape, the head at the origin of ``world``."""
    joints = rig.joints
    weights = np.zeros(len(rig.shape_names))
    return Pose(0, 0.0, 0.0, np.eye(4), joints.translations.copy(), joints.rotations.copy(), weights)
