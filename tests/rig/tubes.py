"""Rigs made of numbers alone: random ones, and a tube between two joints, on which skinning shows its faults."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from retarget.frames import Pose
from retarget.geometry import IDENTITY_QUAT, inverse, matrix_from_quat, quat_from_axis_angle, transform
from retarget.rig.model import Joints, Material, Rig, Shape, Surface
from retarget.rig.normals import vertex_normals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def random_turns(rng: np.random.Generator, count: int, spread_rad: float) -> Array:
    axes = rng.normal(size=(count, 3))
    return quat_from_axis_angle(axes / np.linalg.norm(axes, axis=1, keepdims=True), rng.normal(0, spread_rad, count))


def make_joints(parents: NDArray[np.intp], translations: Array, rotations: Array) -> Joints:
    T = transform(matrix_from_quat(rotations), translations)
    for j, parent in enumerate(parents):
        if parent >= 0:
            T[j] = T[parent] @ T[j]
    return Joints(tuple(f"joint{j}" for j in range(len(parents))), parents, translations, rotations, T, inverse(T))


def random_joints(rng: np.random.Generator, count: int) -> Joints:
    parents = np.array([-1, *(rng.integers(-1, j) for j in range(1, count))], np.intp)
    return make_joints(parents, rng.normal(0, 0.05, (count, 3)), random_turns(rng, count, 1.0))


def make_rig(joints: Joints, *surfaces: Surface) -> Rig:
    names = tuple(f"shape{b}" for b in range(len(surfaces[0].shapes)))
    return Rig("made", Path("made/rig.toml"), joints, surfaces, names, {}, 0, None, (None, None), None)


def random_surface(
    rng: np.random.Generator, joints: int, vertices: int = 60, shapes: int = 5, influences: int = 4
) -> Surface:
    """Vertices, triangles and weights without order, near the origin."""
    positions = rng.normal(0, 0.1, (vertices, 3)).astype(np.float32)
    triangles = np.array([rng.choice(vertices, 3, replace=False) for _ in range(2 * vertices)], np.int32)
    weights = rng.random((vertices, influences)).astype(np.float32)
    weights[rng.random(weights.shape) < 0.3] = 0
    weights[:, 0] += 0.01
    return Surface(
        name="random",
        positions=positions,
        normals=vertex_normals(positions, triangles),
        triangles=triangles,
        joints=rng.integers(0, joints, (vertices, influences)),
        joint_weights=weights / weights.sum(axis=1, keepdims=True),
        shapes=tuple(
            Shape(np.sort(rng.choice(vertices, 9, replace=False)), rng.normal(0, 0.01, (9, 3)).astype(np.float32))
            for _ in range(shapes)
        ),
        material=Material(),
    )


def random_pose(rng: np.random.Generator, rig: Rig, spread_rad: float = 0.4) -> Pose:
    count = len(rig.joints.names)
    turned = random_turns(rng, count, spread_rad)
    return make_pose(
        rig, rig.joints.translations + rng.normal(0, 0.01, (count, 3)), turned, rng.random(len(rig.shape_names))
    )


def make_pose(
    rig: Rig, translations: Array | None = None, rotations: Array | None = None, weights: Array | None = None
) -> Pose:
    """The rest pose of the rig but for what is given."""
    return Pose(
        number=0,
        time_s=0.0,
        received_s=0.0,
        T_world_head=np.eye(4),
        translations=rig.joints.translations if translations is None else translations,
        rotations=rig.joints.rotations if rotations is None else rotations,
        weights=np.zeros(len(rig.shape_names)) if weights is None else weights,
    )


def tube(rows: int = 41, columns: int = 32, radius: float = 0.05, length: float = 0.4) -> Rig:
    """A tube along +X around the joint at x = 0, the second joint half-way, with weights that pass over smoothly."""
    x = np.linspace(0, length, rows)
    around = np.linspace(0, 2 * np.pi, columns, endpoint=False)
    grid = np.stack(np.broadcast_arrays(x[:, None], radius * np.cos(around), radius * np.sin(around)), axis=-1)
    positions = grid.reshape(-1, 3).astype(np.float32)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij"))
    a, b = i * columns + j, i * columns + (j + 1) % columns
    triangles = np.concatenate([np.stack([a, b, a + columns], 1), np.stack([b, b + columns, a + columns], 1)])
    share = np.clip((positions[:, 0] / length - 0.25) * 2, 0, 1)
    joints = make_joints(
        np.array([-1, 0], np.intp), np.array([[0, 0, 0], [length / 2, 0, 0]]), np.tile(IDENTITY_QUAT, (2, 1))
    )
    surface = Surface(
        name="tube",
        positions=positions,
        normals=vertex_normals(positions, triangles.astype(np.int32)),
        triangles=triangles.astype(np.int32),
        joints=np.tile(np.array([0, 1]), (len(positions), 1)),
        joint_weights=np.stack([1 - share, share], axis=1).astype(np.float32),
        shapes=(),
        material=Material(),
    )
    return make_rig(joints, surface)
