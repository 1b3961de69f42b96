"""Hair and pendants: joints that trail after the head's motion, each as a PD controlled mass.

A joint named under [secondary] in rig.toml carries a mass at its tip: the middle of its children, or of the vertices it
carries. The mass follows the place that the tip would have if all were rigid, in the room, so that walking, turning and
nodding all count; the joint turns towards the mass and keeps its length. What hangs below it goes along. An `alpha`
near 1 damps little and lets it swing.

    [secondary]
    fringe = {}                        # the gains of `retarget.filters.PdGains`, any of kp, kd, mass, alpha
    pendantLeft = { alpha = 0.95 }
"""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np

from retarget import geometry
from retarget.errors import InputError
from retarget.filters import PdGains, PdMass
from retarget.rig.hierarchy import joint_matrices

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import Pose
    from retarget.rig.model import Rig
    from retarget.toml_table import Table

    Array = NDArray[np.float64]

FARTHEST_RAD = math.radians(60.0)
"""No joint turns farther from where it would be if all were rigid."""
SHORTEST_M = 1e-3
"""A tip nearer than this to its joint has no direction."""


class SecondaryMotion:
    """Lets the secondary joints of one rig trail; feed it every pose in order."""

    def __init__(self, rig: Rig, T_world_reference: Array | None = None, size: float = 1.0) -> None:
        """`T_world_reference` as in `JointMapping`; `size` is the rig's over the performer's.

        InputError where a joint has neither children nor vertices, so nothing that could trail.
        """
        self._rig, self._size = rig, size
        self._T_world_reference = np.eye(4) if T_world_reference is None else np.asarray(T_world_reference, float)
        self._joints = sorted(rig.secondary)  # parents stand before their children
        self._tips = {j: _tip(rig, j) for j in self._joints}
        self._masses = {j: PdMass(rig.secondary[j]) for j in self._joints}

    def reset(self) -> None:
        """All masses are where they would be if all were rigid."""
        for mass in self._masses.values():
            mass.reset()

    def __call__(self, pose: Pose) -> Pose:
        """`pose` with its secondary joints turned."""
        if not self._joints:
            return pose
        rotations = pose.rotations.copy()
        shift = self._shift(pose)
        for j in self._joints:
            T = joint_matrices(self._rig.joints, pose.translations, rotations)
            origin, arm = T[j, :3, 3], T[j, :3, :3] @ self._tips[j]
            # In the room, but with the axes of the rig: the head's own way is added to the rig's.
            room = shift - T[self._rig.head_joint, :3, 3]
            trailing = self._masses[j](origin + arm + room, pose.time_s) - room - origin
            turned = _shortest_turn(arm, trailing) @ T[j, :3, :3]
            parent = int(self._rig.joints.parents[j])
            local = turned if parent < 0 else T[parent, :3, :3].T @ turned
            rotations[j] = geometry.align_hemisphere(geometry.quat_from_matrix(local), rotations[j])
        return replace(pose, rotations=rotations)

    def _shift(self, pose: Pose) -> Array:
        """(3,) [m]: how far the head is from where it was in the reference, in the axes and the size of the rig."""
        way: Array = pose.T_world_head[:3, 3] - self._T_world_reference[:3, 3]
        shift: Array = self._size * self._T_world_reference[:3, :3].T @ way
        return shift


def read_gains(table: Table) -> PdGains:
    """The gains of one joint; InputError, with the place, for what is unknown or no gain."""
    names = [field.name for field in fields(PdGains)]
    table.only(*names)
    try:
        gains = PdGains(**{name: table.number(name) for name in names if name in table.values})
        PdMass(gains)  # too stiff a joint is told when the rig is read
    except InputError as error:
        raise InputError(f"{table.path}: the gains of {table.name!r} in [secondary] cannot be used: {error}") from error
    return gains


def _tip(rig: Rig, joint: int) -> Array:
    """(3,) [m], in the joint's own axes, at rest."""
    T_joint_rig = geometry.inverse(rig.joints.T_rig_joint[joint])
    children = np.flatnonzero(rig.joints.parents == joint)
    below = geometry.apply(T_joint_rig, rig.joints.T_rig_joint[children, :3, 3])
    tip: Array = below.mean(axis=0) if len(children) else _middle(rig, joint)
    if not np.linalg.norm(tip) > SHORTEST_M:
        raise InputError(
            f"The joint {rig.joints.names[joint]!r} of the rig {rig.name!r} is marked secondary, but nothing hangs "
            "from it: give it a child or bind vertices to it, or take it out of [secondary]."
        )
    return tip


def _middle(rig: Rig, joint: int) -> Array:
    """(3,) [m], in the joint's axes: the mean of the vertices it carries, by their weights; NaN without any."""
    total, weight = np.zeros(3), 0.0
    for surface in rig.surfaces:
        shares = np.where(surface.joints == joint, surface.joint_weights, 0.0).sum(axis=1)
        total, weight = total + shares @ surface.positions, weight + float(shares.sum())
    T_joint_mesh = rig.joints.T_joint_mesh[joint]
    return geometry.apply(T_joint_mesh, total[None] / weight)[0] if weight else np.full(3, np.nan)


def _shortest_turn(a: Array, b: Array) -> Array:
    """(3, 3): the turn from the direction of `a` (3,) towards that of `b` (3,), no farther than `FARTHEST_RAD`."""
    axis = np.cross(a, b)
    sine, cosine = float(np.linalg.norm(axis)), float(a @ b)
    if sine < 1e-12 * max(abs(cosine), 1e-12):  # along the same line: no axis, and nothing to turn
        return np.eye(3)
    angle = min(math.atan2(sine, cosine), FARTHEST_RAD)
    return geometry.matrix_from_quat(geometry.quat_from_axis_angle(axis / sine, angle))
