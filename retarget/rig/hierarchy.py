"""Where the joints of a rig are in a pose: forward kinematics, one hierarchy level at a time."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from retarget.geometry import matrix_from_quat, transform

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.rig.model import Joints

    Array = NDArray[np.float64]


def joint_matrices(joints: Joints, translations: Array, rotations: Array) -> Array:
    """T_rig_joint (J, 4, 4) of a pose relative to the parents: translations (J, 3) [m], unit quaternions (J, 4) xyzw.

    With the rest values of `joints` it gives their `T_rig_joint`. NaN of a joint reaches all that hang below it.
    """
    T = transform(matrix_from_quat(rotations), translations)
    for level, parents in _levels(joints.parents.tobytes(), joints.parents.dtype.str):
        T[level] = T[parents] @ T[level]
    return T


@lru_cache(maxsize=16)
def _levels(parents: bytes, dtype: str) -> tuple[tuple[NDArray[np.intp], NDArray[np.intp]], ...]:
    """The joints of every depth from 1 on, and their parents; kept, since a rig's hierarchy does not change."""
    above = np.frombuffer(parents, dtype)
    depth = np.zeros(len(above), np.intp)
    for j, parent in enumerate(above):
        depth[j] = 0 if parent < 0 else depth[parent] + 1
    levels = (np.flatnonzero(depth == d) for d in range(1, int(depth.max(initial=0)) + 1))
    return tuple((level, above[level].astype(np.intp)) for level in levels)
