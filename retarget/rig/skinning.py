"""From a pose to vertices: blend shapes, then skinning, then normals. All surfaces of the rig in one pass.

Vertices come out in ``rig``; the pose's `T_world_head` is left to the display. Blend shapes are added in the bind pose,
before skinning, as in glTF 2.0, section 3.7.2.2; how joints share a vertex is told in `blending`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from retarget.errors import InputError
from retarget.rig.blending import BLENDS
from retarget.rig.hierarchy import joint_matrices
from retarget.rig.normals import SmoothNormals, weld

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csr_array

    from retarget.frames import Pose
    from retarget.rig.model import Rig

    Array = NDArray[np.float64]
    Array32 = NDArray[np.float32]
    Sparse = csr_array[np.float32, tuple[int, int]]

SkinningMethod = Literal["linear", "dual-quaternion"]

RIGID = 1e-3
"""Largest entry of R^T R - 1 of a bind matrix that counts as rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Deformed:
    """The rig's surfaces in one pose; one array per surface, new in every frame."""

    positions: tuple[Array32, ...]
    """(V, 3) [m], ``rig``."""
    normals: tuple[Array32, ...]
    """(V, 3), unit."""


class Skin:
    """Deforms the surfaces of one rig; make it once and call it for every pose, from any thread."""

    def __init__(self, rig: Rig, method: SkinningMethod = "linear") -> None:
        """For `rig`; InputError for an unknown `method`, or dual quaternions where a bind matrix is not rigid."""
        if method not in BLENDS:
            raise InputError(f"There is no skinning method {method!r}; there are: {', '.join(BLENDS)}.")
        self._rig = rig
        self._starts = np.cumsum([0, *(len(s.positions) for s in rig.surfaces)])
        self._bind = np.concatenate([s.positions for s in rig.surfaces])
        weights = _weight_matrix(rig, self._starts)
        self._used = np.unique(weights.indices).astype(np.intp)
        if method == "dual-quaternion":
            _require_rigid(rig, self._used)
        self._blend = BLENDS[method](weights[:, self._used])
        self._shapes = _shape_matrix(rig, self._starts)
        self._normals = _smooth_normals(rig, self._starts, self._bind, weights, self._shapes)

    def __call__(self, pose: Pose) -> Deformed:
        """The surfaces in `pose`, without its `T_world_head`; ValueError where it holds NaN or does not fit the rig."""
        positions = self.positions(pose)
        return Deformed(self._split(positions), self._split(self._normals(positions)))

    def positions(self, pose: Pose) -> Array32:
        """(V, 3) [m], ``rig``: the vertices of all surfaces one after the other; raises as a call does."""
        _check(self._rig, pose)
        T_rig_joint = joint_matrices(self._rig.joints, pose.translations, pose.rotations)
        T_rig_mesh = T_rig_joint[self._used] @ self._rig.joints.T_joint_mesh[self._used]
        return self._blend(T_rig_mesh, self._shaped(pose.weights))

    def _shaped(self, weights: Array) -> Array32:
        """(V, 3): the bind positions with the blend shapes added."""
        if not weights.any():
            return self._bind
        offsets: Array32 = self._shapes @ weights.astype(np.float32)
        return self._bind + offsets.reshape(-1, 3)

    def _split(self, values: Array32) -> tuple[Array32, ...]:
        return tuple(values[a:b] for a, b in zip(self._starts[:-1], self._starts[1:], strict=True))


def _check(rig: Rig, pose: Pose) -> None:
    """ValueError that names the joint or shape whose values cannot be used."""
    J, B = len(rig.joints.names), len(rig.shape_names)
    if pose.translations.shape != (J, 3) or pose.rotations.shape != (J, 4) or pose.weights.shape != (B,):
        raise ValueError(
            f"The rig {rig.name!r} has {J} joints and {B} blend shapes; the pose holds translations "
            f"{pose.translations.shape}, rotations {pose.rotations.shape} and weights {pose.weights.shape}."
        )
    finite = np.isfinite(pose.translations).all(axis=1) & np.isfinite(pose.rotations).all(axis=1)
    if not finite.all():
        raise ValueError(
            f"The pose of joint {rig.joints.names[int(np.argmin(finite))]!r} is not finite; fill gaps before skinning."
        )
    finite = np.isfinite(pose.weights)
    if not finite.all():
        raise ValueError(
            f"The weight of {rig.shape_names[int(np.argmin(finite))]!r} is not finite; fill gaps before skinning."
        )


def _require_rigid(rig: Rig, used: NDArray[np.intp]) -> None:
    R = rig.joints.T_joint_mesh[used, :3, :3]
    error = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2))
    if error.max() > RIGID:
        name = rig.joints.names[used[int(np.argmax(error))]]
        raise InputError(f"The rig {rig.name!r} binds the joint {name!r} with scale, which needs linear skinning.")


def _weight_matrix(rig: Rig, starts: NDArray[np.intp]) -> Sparse:
    """(V, J) joint weights of all surfaces, one after the other; a joint of weight 0 takes no place."""
    rows, columns, values = [], [], []
    for surface, start in zip(rig.surfaces, starts, strict=False):
        vertices, slots = np.nonzero(surface.joint_weights)
        rows.append(vertices + start)
        columns.append(surface.joints[vertices, slots])
        values.append(surface.joint_weights[vertices, slots])
    return _sparse(values, rows, columns, (int(starts[-1]), len(rig.joints.names)))


def _shape_matrix(rig: Rig, starts: NDArray[np.intp]) -> Sparse:
    """(3 V, B): column b holds x, y, z of every vertex's offset at weight 1 of shape b."""
    rows, columns, values = [], [], []
    for surface, start in zip(rig.surfaces, starts, strict=False):
        for b, shape in enumerate(surface.shapes):
            rows.append((3 * (shape.vertices[:, None] + start) + np.arange(3)).ravel())
            columns.append(np.full(shape.offsets.size, b))
            values.append(shape.offsets.ravel())
    return _sparse(values, rows, columns, (3 * int(starts[-1]), len(rig.shape_names)))


def _sparse(
    values: list[Array32], rows: list[NDArray[np.intp]], columns: list[NDArray[np.intp]], shape: tuple[int, int]
) -> Sparse:
    """The matrix of `shape` with the values at these places; values at one place add up."""
    from scipy.sparse import coo_array

    nothing = np.zeros(0, np.intp)
    places = np.concatenate([*rows, nothing]), np.concatenate([*columns, nothing])
    return coo_array((np.concatenate([*values, nothing.astype(np.float32)]), places), shape).tocsr()


def _smooth_normals(
    rig: Rig, starts: NDArray[np.intp], bind: Array32, weights: Sparse, shapes: Sparse
) -> SmoothNormals:
    from scipy.sparse import hstack

    normals = np.concatenate([s.normals for s in rig.surfaces])
    triangles = np.concatenate([s.triangles + start for s, start in zip(rig.surfaces, starts, strict=False)])
    offsets = shapes.reshape((len(bind), 3 * len(rig.shape_names)))
    motion = hstack([weights, offsets], format="csr")
    return SmoothNormals(triangles.astype(np.int32), weld(bind, normals, motion), normals)
