"""Turns of single joints in plain numbers: for one quaternion at a time, numpy's calls cost ten times the arithmetic.

Quaternions are xyzw tuples of unit length. The same algebra on arrays is in `retarget.geometry`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.rig.model import Joints

    Array = NDArray[np.float64]

Quat = geometry.Quat


def multiply(a: Quat, b: Quat) -> Quat:
    """First the turn `b`, then `a`."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def about(axis: tuple[float, float, float], angle: float) -> Quat:
    """The turn by `angle` [rad] about the unit `axis`."""
    sine = math.sin(angle / 2)
    return axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(angle / 2)


def from_matrix(R: Array) -> Quat:
    """The turn of a rotation matrix (3, 3), w >= 0."""
    return geometry.quat_from_rows(R.tolist())


def part(turn: Quat, fraction: float) -> Quat:
    """`fraction` of the `turn`, which has w >= 0: about the same axis, by that part of its angle."""
    x, y, z, w = turn
    sine = math.sqrt(x * x + y * y + z * z)
    half = math.atan2(sine, w) * fraction
    factor = math.sin(half) / sine if sine > 0 else 0.0
    return x * factor, y * factor, z * factor, math.cos(half)


@dataclass(frozen=True, slots=True)
class Turner:
    """Turns one joint from its rest by a turn that is given in the axes of ``rig``."""

    joint: int
    before: Quat
    """``rig`` to the parent, at rest."""
    after: Quat
    """The joint's rest rotation in ``rig``."""

    def local(self, turn: Quat) -> Quat:
        """The joint's rotation relative to its parent."""
        return multiply(multiply(self.before, turn), self.after)


def turner(joints: Joints, joint: int) -> Turner:
    """For the joint of that index: R_parent_rig turn R_rig_parent R_parent_joint is its rotation after the turn."""
    R_rig_parent = parent_rest(joints, joint)
    R_rig_joint = R_rig_parent @ geometry.matrix_from_quat(joints.rotations[joint])
    return Turner(joint, from_matrix(R_rig_parent.T), from_matrix(R_rig_joint))


def parent_rest(joints: Joints, joint: int) -> Array:
    """R_rig_parent (3, 3) at rest, of the parent of the joint of that index."""
    parent = int(joints.parents[joint])
    return np.eye(3) if parent < 0 else joints.T_rig_joint[parent, :3, :3]
