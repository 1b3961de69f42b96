"""What cameras see of the performer: markers in the room, with noise, dropouts and outliers, and the truth beside them.

The forward model is the mapping turned round: M = M0 + K^-1 (J - J0), K diagonal where its directions differ, carried
by the performer's own jaw where the site rides on it, then by the head. Metres, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from retarget import geometry
from retarget.frames import MarkerFrame
from retarget.performer import moved_by

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from retarget.frames import MarkerLayout
    from tests.synthetic.face import SyntheticFace
    from tests.synthetic.motion import FaceMotion

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SyntheticTake:
    """A recording, and what it should be solved to."""

    layout: MarkerLayout
    times: Array
    """(T,) [s]."""
    p_world: Array
    """(T, M, 3) [m]: what the cameras report; NaN where they see nothing."""
    T_world_head: Array
    """(T, 4, 4), true."""
    performer_jaw_rad: Array
    """(T,), true turn of the performer's jaw."""
    rig_jaw_rad: Array
    """(T,), true turn of the rig's jaw."""
    joints: dict[str, Array]
    """By site, true places of the rig's joint, (T, 3) [m], the rig's ``head``."""

    def frames(self) -> Iterator[MarkerFrame]:
        """As a source gives them: in ``world``."""
        for i, (t, p) in enumerate(zip(self.times.tolist(), self.p_world, strict=True)):
            yield MarkerFrame(i, t, t, self.layout, p)

    def stabilised(self) -> Iterator[MarkerFrame]:
        """In ``head``, by the true motion of the head: what a perfect stabiliser gives."""
        for frame, T_world_head in zip(self.frames(), self.T_world_head, strict=True):
            p_head = geometry.apply(geometry.inverse(T_world_head), frame.positions)
            yield replace(frame, positions=p_head, T_world_head=T_world_head)


def captured(face: SyntheticFace, motion: FaceMotion) -> SyntheticTake:
    """`motion` as perfect cameras see it on this `face`."""
    jaw = face.performer.jaw
    if jaw is None or face.rig.jaw is None:
        raise ValueError("A synthetic face needs a rig with a jaw.")
    performer_jaw_rad = motion.jaw_rad / jaw.gain
    p_head = np.tile(face.performer.neutral, (len(motion.times), 1, 1))
    joints = {}
    for site, moves in zip(motion.sites, np.moveaxis(motion.moves, 1, 0), strict=True):
        place = face.rig.sites[site]
        joints[site] = place.rest + moves
        if site in face.layout.sites:
            marker = face.layout.sites.index(site)
            p_head[:, marker] += moved_by(np.linalg.inv(face.performer.K[site]).astype(float), moves)
        if place.rides_jaw:
            joints[site] = _carried(joints[site], face.rig.jaw.axis, face.rig.jaw.pivot, motion.jaw_rad)
            if site in face.layout.sites:
                p_head[:, marker] = _carried(p_head[:, marker], jaw.axis, jaw.pivot, performer_jaw_rad)
    p_world = np.einsum("tij,tmj->tmi", motion.T_world_head[:, :3, :3], p_head) + motion.T_world_head[:, None, :3, 3]
    return SyntheticTake(
        face.layout, motion.times, p_world, motion.T_world_head, performer_jaw_rad, motion.jaw_rad, joints
    )


def _carried(points: Array, axis: Array, pivot: Array, angles: Array) -> Array:
    """`points` (T, 3) turned about the hinge by `angles` (T,) [rad]."""
    R = geometry.matrix_from_quat(geometry.quat_from_axis_angle(axis, angles))
    carried: Array = np.einsum("tij,tj->ti", R, points - pivot) + pivot
    return carried


def with_noise(take: SyntheticTake, rng: np.random.Generator, sigma_m: float) -> SyntheticTake:
    """Every coordinate of every marker off by `sigma_m`, independently."""
    return replace(take, p_world=take.p_world + rng.normal(scale=sigma_m, size=take.p_world.shape))


def with_dropouts(
    take: SyntheticTake, rng: np.random.Generator, share: float, mean_frames: float = 6.0, still_s: float = 0.0
) -> SyntheticTake:
    """About `share` of all samples missing, in gaps of `mean_frames` on average; none in the first `still_s`."""
    p_world = take.p_world.copy()
    first = int(np.searchsorted(take.times, take.times[0] + still_s))
    count, markers = p_world.shape[:2]
    gaps = -np.log1p(-share) * (count - first) / mean_frames  # so that gaps that overlap leave the share as asked
    for marker in range(markers):
        for _ in range(rng.poisson(gaps)):
            start = rng.integers(first, count)
            p_world[start : start + rng.geometric(1 / mean_frames), marker] = np.nan
    return replace(take, p_world=p_world)


def with_outliers(
    take: SyntheticTake, rng: np.random.Generator, share: float, reach_m: tuple[float, float] = (0.005, 0.03)
) -> SyntheticTake:
    """`share` of all samples off by a distance in `reach_m`, in any direction."""
    p_world = take.p_world.copy()
    hit = rng.random(p_world.shape[:2]) < share
    away = rng.normal(size=(int(hit.sum()), 3))
    away *= rng.uniform(*reach_m, (len(away), 1)) / np.linalg.norm(away, axis=1, keepdims=True)
    p_world[hit] += away
    return replace(take, p_world=p_world)
