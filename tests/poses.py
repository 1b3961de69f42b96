"""Small poses for tests of what takes poses."""

from __future__ import annotations

import numpy as np

from retarget.frames import Pose


def make_pose(number: int = 0, time_s: float | None = None, joints: int = 2, shapes: int = 1) -> Pose:
    """A pose at rest in the origin; `time_s` is 60 Hz of the number unless given."""
    return Pose(
        number=number,
        time_s=number / 60 if time_s is None else time_s,
        received_s=0.0,
        T_world_head=np.eye(4),
        translations=np.zeros((joints, 3)),
        rotations=np.tile([0.0, 0.0, 0.0, 1.0], (joints, 1)),
        weights=np.zeros(shapes),
    )
