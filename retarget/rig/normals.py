"""Unit normals of a surface that moves: the area-weighted mean of the triangles around each vertex.

Exporters split a vertex wherever its texture coordinates differ, and the normals of the halves would drift apart as a
visible seam; so vertices that belong together are welded for this purpose, by `weld`. The cross product of two edges is
twice the triangle's area times its normal, which weights the mean by area at no cost. Reference: Gouraud 1971; Max,
"Weights for computing vertex normals from facet normals", J. Graphics Tools 4(2), 1999, compares the weights.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csr_array

    Array = NDArray[Any]
    Sparse = csr_array[np.float32, tuple[int, int]]

CREASE_CHORD = 0.5
"""Distance of two unit normals, about 29 degrees, beyond which a split vertex is an edge that is meant to be seen."""
SAME_MOTION = 1e-4
"""Largest difference of joint weights, or of blend-shape offsets [m], between two halves of one vertex."""
MAX_ROUNDS = 16
"""Largest number of different vertices looked for at one place; any more stay apart."""


class SmoothNormals:
    """Normals of any deformation of one mesh; costs two gathers, a cross product and a sparse product per call."""

    def __init__(self, triangles: NDArray[np.int32], groups: NDArray[np.intp], rest: NDArray[np.float32]) -> None:
        """For `triangles` (F, 3) over V vertices, of which those with equal `groups` (V,) share their normal.

        `rest` (V, 3) are the normals of vertices around which there is no area: unused, or all triangles collapsed.
        """
        self._corners = np.ascontiguousarray(triangles.T)  # (3, F)
        self._around = _incidence(triangles, groups)
        self._rest = rest

    def __call__(self, positions: Array) -> NDArray[np.float32]:
        """(V, 3) unit normals of the positions (V, 3)."""
        axes = np.ascontiguousarray(positions.T, np.float32)  # (3, V): one axis at a time stays in cache
        total = np.ascontiguousarray((self._around @ _doubled_areas(axes, self._corners)).T)  # (3, V)
        squares = np.einsum("av,av->v", total, total)
        flat = ~(squares > 1e-30)
        squares[flat] = 1.0
        normals = np.ascontiguousarray((total / np.sqrt(squares)).T)
        normals[flat] = self._rest[flat]
        return normals


def vertex_normals(positions: Array, triangles: NDArray[np.int32]) -> NDArray[np.float32]:
    """(V, 3) unit normals of positions (V, 3) and triangles (F, 3), smooth across vertices at one place.

    A vertex around which there is no area gets +Z.
    """
    groups = weld(positions)
    return SmoothNormals(triangles, groups, np.tile(np.array([0, 0, 1], np.float32), (len(positions), 1)))(positions)


def weld(positions: Array, normals: Array | None = None, motion: Sparse | None = None) -> NDArray[np.intp]:
    """(V,) for every vertex the number of the first one that it belongs to.

    Two vertices belong together where they stand at exactly the same place of positions (V, 3), their `normals` (V, 3)
    agree (a hard edge stays hard) and the rows of `motion` (V, K), what moves them, agree (lips that touch at rest stay
    two lips). Without these the place alone counts.
    """
    _, place = np.unique(np.ascontiguousarray(positions), axis=0, return_inverse=True)
    place = place.reshape(-1)  # numpy 2.0 alone gives it a second axis
    groups = np.arange(len(positions))
    left = np.flatnonzero(np.bincount(place)[place] > 1) if len(place) else groups
    for _ in range(MAX_ROUNDS):
        if not len(left):
            break
        first = np.full(len(positions), len(positions))
        np.minimum.at(first, place[left], left)
        leaders = first[place[left]]
        same = _agree(left, leaders, normals, motion)
        groups[left[same]] = leaders[same]
        left = left[~same]
    return groups


def _agree(a: NDArray[np.intp], b: NDArray[np.intp], normals: Array | None, motion: Sparse | None) -> NDArray[np.bool_]:
    same = np.ones(len(a), np.bool_)
    if normals is not None:
        same &= np.linalg.norm(normals[a] - normals[b], axis=1) < CREASE_CHORD
    if motion is not None:
        same &= abs(motion[a] - motion[b]).max(axis=1).toarray().ravel() < SAME_MOTION
    same[a == b] = True
    return same


def _doubled_areas(axes: Array, corners: NDArray[np.int32]) -> Array:
    """(F, 3): per triangle the normal times twice the area."""
    a, b, c = (axes.take(corner, axis=1) for corner in corners)
    ux, uy, uz = b - a
    vx, vy, vz = c - a
    out = np.empty((corners.shape[1], 3), axes.dtype)
    out[:, 0] = uy * vz - uz * vy
    out[:, 1] = uz * vx - ux * vz
    out[:, 2] = ux * vy - uy * vx
    return out


def _incidence(triangles: NDArray[np.int32], groups: NDArray[np.intp]) -> Sparse:
    """(V, F): 1 where the triangle touches the vertex or one of its group."""
    from scipy.sparse import csr_array

    count, faces = len(groups), len(triangles)
    touches = csr_array(
        (np.ones(triangles.size, np.float32), (groups[triangles.ravel()], np.repeat(np.arange(faces), 3))),
        shape=(count, faces),
    )
    return touches[groups]
