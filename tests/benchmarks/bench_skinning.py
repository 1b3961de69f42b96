"""A pose to vertices and normals: 5,000 vertices, 52 blend shapes, 50 joints, 4 influences; and the rig that ships.

The peer is numpy as one would write it down: dense shapes, joint matrices gathered per influence, triangles added up
with `np.add.at`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from retarget.rig.hierarchy import joint_matrices
from retarget.rig.load import load_rig
from retarget.rig.model import Shape
from retarget.rig.skinning import Skin
from tests.benchmarks.report import Row, seconds_per_call
from tests.rig.tubes import make_pose, make_rig, random_joints, random_pose, random_surface, tube

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from retarget.frames import Pose
    from retarget.rig.model import Rig

PEER = "plain numpy"


def rows() -> Iterator[Row]:
    """Milliseconds per frame."""
    rig = _rig_of_5000_vertices()
    pose = random_pose(np.random.default_rng(2), rig)
    linear, dual = Skin(rig), Skin(rig, "dual-quaternion")
    plain_positions, plain_all = _plain(rig)
    at_rest = make_pose(rig, pose.translations, pose.rotations)
    yield _row("5,000 vertices, 52 shapes: positions", lambda: linear.positions(pose), lambda: plain_positions(pose))
    yield _row("the same with normals", lambda: linear(pose), lambda: plain_all(pose), "< 1.5 ms")
    yield _row("the same with no shape active", lambda: linear(at_rest))
    yield _row("dual quaternions: positions", lambda: dual.positions(pose))
    yield _row("the same with normals", lambda: dual(pose))
    yield _row(
        "joint matrices, 50 joints",
        lambda: joint_matrices(rig.joints, pose.translations, pose.rotations),
        aim="< 0.15 ms",
    )
    human = load_rig("human")
    smiling, skin = random_pose(np.random.default_rng(3), human), Skin(human)
    count = sum(len(s.positions) for s in human.surfaces)
    yield _row(f"human, {count:,} vertices, all shapes, with normals", lambda: skin(smiling))


def _row(what: str, ours: Callable[[], object], peer: Callable[[], object] | None = None, aim: str = "") -> Row:
    own = 1e3 * seconds_per_call(ours)
    if peer is None:
        return Row(what, own, "ms", aim=aim)
    return Row(what, own, "ms", PEER, 1e3 * seconds_per_call(peer), aim)


def _rig_of_5000_vertices() -> Rig:
    """A tube's triangles with random weights and shapes that move a fifth of it each."""
    rng = np.random.default_rng(1)
    (body,) = tube(rows=100, columns=50).surfaces
    count = len(body.positions)
    loose = random_surface(rng, joints=50, vertices=count, shapes=0)
    shapes = tuple(
        Shape(
            np.sort(rng.choice(count, count // 5, replace=False)),
            rng.normal(0, 0.003, (count // 5, 3)).astype(np.float32),
        )
        for _ in range(52)
    )
    surface = replace(body, joints=loose.joints, joint_weights=loose.joint_weights, shapes=shapes)
    return make_rig(random_joints(rng, 50), surface)


def _plain(rig: Rig) -> tuple[Callable[[Pose], NDArray[np.float32]], Callable[[Pose], NDArray[np.float32]]]:
    """Positions, and normals, of the rig's one surface."""
    (surface,) = rig.surfaces
    offsets = np.zeros((len(surface.shapes), *surface.positions.shape), np.float32)
    for dense, shape in zip(offsets, surface.shapes, strict=True):
        dense[shape.vertices] = shape.offsets

    def positions(pose: Pose) -> NDArray[np.float32]:
        T_rig_joint = joint_matrices(rig.joints, pose.translations, pose.rotations)
        motions = (T_rig_joint @ rig.joints.T_joint_mesh)[:, :3].astype(np.float32)
        shaped = surface.positions + np.tensordot(pose.weights.astype(np.float32), offsets, 1)
        blended = (surface.joint_weights[:, :, None, None] * motions[surface.joints]).sum(axis=1)
        return np.asarray(np.einsum("vij,vj->vi", blended[:, :, :3], shaped) + blended[:, :, 3], np.float32)

    def normals(pose: Pose) -> NDArray[np.float32]:
        points = positions(pose)
        a, b, c = (points[corner] for corner in surface.triangles.T)
        total = np.zeros_like(points)
        for corner in surface.triangles.T:
            np.add.at(total, corner, np.cross(b - a, c - a))
        return np.asarray(total / np.linalg.norm(total, axis=1, keepdims=True), np.float32)

    return positions, normals
