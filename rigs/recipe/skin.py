"""Cut the head out of the body along a plane through the neck, and close it with a rounded, flat base.

Every vertex of the result is a weighted mean of base vertices plus a fixed offset, so that anything known on the base
mesh (bone weights, shape targets) carries over by one sparse product. Units: metres, frame of the base mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

if TYPE_CHECKING:
    from numpy.typing import NDArray

SNAP_M = 0.0025
"""A vertex nearer to the cutting plane is moved onto it: no slivers along the cut."""
BASE_RINGS_M = ((0.0022, 0.0010), (0.0042, 0.0032), (0.0047, 0.0072), (0.0050, 0.030))
"""(below the cut, inwards) of each ring that rounds and closes the base."""


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """The welded surface of the head."""

    lift: sparse.csr_array
    """(V, B) weights of the base vertices, rows add up to 1."""
    offset: NDArray[np.float64]
    """(V, 3) [m], added after `lift`."""
    triangles: NDArray[np.intp]
    """(F, 3)."""
    uv: NDArray[np.float64]
    """(F, 3, 2), texture coordinates of every corner, origin at the lower left."""
    rim: NDArray[np.intp]
    """(R,) vertices of the cut, in order around the neck."""

    def positions(self, base: NDArray[np.float64]) -> NDArray[np.float64]:
        """Vertices (V, 3) [m] for base vertices (B, 3) [m]."""
        return self.lift @ base + self.offset


def triangulate(quads: NDArray[np.intp], vertices: NDArray[np.float64]) -> NDArray[np.intp]:
    """(F, 4) quads as corner numbers (F, 2, 3) of two triangles each, split along the shorter diagonal."""
    a, b, c, d = (vertices[quads[:, k]] for k in range(4))
    through_ac = np.linalg.norm(a - c, axis=1) <= np.linalg.norm(b - d, axis=1)
    return np.where(through_ac[:, None, None], [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]])


def cut_head(
    vertices: NDArray[np.float64],
    quads: NDArray[np.intp],
    corner_uv: NDArray[np.float64],
    plane: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> Skin:
    """The part of the mesh on the positive side of `plane` (point, unit normal) that holds the highest vertex, open
    below.
    """
    split = triangulate(quads, vertices)
    triangles = np.take_along_axis(quads[:, None, :], split, axis=2).reshape(-1, 3)
    uv = corner_uv[np.arange(len(quads))[:, None, None], split].reshape(-1, 3, 2)
    point, normal = plane
    side = (vertices - point) @ normal
    near = np.abs(side) < SNAP_M
    offset = np.where(near[:, None], -side[:, None] * normal, 0.0)
    cut = _Cut(np.where(near, 0.0, side))
    for triangle, corners in zip(triangles, uv, strict=True):
        cut.add(triangle, corners)
    return _compact(cut, vertices, offset)


class _Cut:
    """Collects triangles on the positive side; edges that cross give new vertices."""

    def __init__(self, side: NDArray[np.float64]) -> None:
        self.side = side
        self.triangles: list[tuple[int, ...]] = []
        self.uv: list[list[NDArray[np.float64]]] = []
        self.crossings: dict[tuple[int, int], int] = {}

    def add(self, triangle: NDArray[np.intp], uv: NDArray[np.float64]) -> None:
        side = self.side[triangle]
        if side.max() <= 0:
            return
        polygon, polygon_uv = [], []
        for k in range(3):
            a, b = int(triangle[k]), int(triangle[(k + 1) % 3])
            if side[k] >= 0:
                polygon.append(a)
                polygon_uv.append(uv[k])
            if side[k] * side[(k + 1) % 3] < 0:
                fraction = side[k] / (side[k] - side[(k + 1) % 3])
                polygon.append(self._crossing(a, b))
                polygon_uv.append(uv[k] + fraction * (uv[(k + 1) % 3] - uv[k]))
        for k in range(1, len(polygon) - 1):
            self.triangles.append((polygon[0], polygon[k], polygon[k + 1]))
            self.uv.append([polygon_uv[0], polygon_uv[k], polygon_uv[k + 1]])

    def _crossing(self, a: int, b: int) -> int:
        return self.crossings.setdefault((min(a, b), max(a, b)), len(self.side) + len(self.crossings))

    def lift(self) -> sparse.csr_array:
        count = len(self.side)
        pairs = np.array(list(self.crossings), dtype=np.intp).reshape(-1, 2)
        share = self.side[pairs[:, 0]] / (self.side[pairs[:, 0]] - self.side[pairs[:, 1]])
        rows = np.arange(len(pairs)).repeat(2)
        new = sparse.csr_array((np.c_[1 - share, share].ravel(), (rows, pairs.ravel())), shape=(len(pairs), count))
        return sparse.csr_array(sparse.vstack([sparse.eye_array(count), new]))


def _compact(cut: _Cut, vertices: NDArray[np.float64], offset: NDArray[np.float64]) -> Skin:
    """Keep the connected piece with the highest vertex, and only the vertices it uses."""
    triangles, uv, lift = np.array(cut.triangles), np.array(cut.uv), cut.lift()
    count = lift.shape[0]
    offset = np.vstack([offset, np.zeros((count - len(offset), 3))])
    edges = sparse.coo_array(
        (np.ones(triangles.size), (triangles.ravel(), np.roll(triangles, 1, 1).ravel())), (count, count)
    )
    piece = csgraph.connected_components(edges, directed=False)[1]
    top = triangles.ravel()[np.argmax(vertices[np.minimum(triangles.ravel(), len(vertices) - 1), 1])]
    kept = piece[triangles[:, 0]] == piece[top]
    used, renumbered = np.unique(triangles[kept], return_inverse=True)
    triangles = renumbered.reshape(-1, 3)
    return Skin(lift[used], offset[used], triangles, uv[kept], _loop(boundary_edges(triangles)))


def boundary_edges(triangles: NDArray[np.intp]) -> NDArray[np.intp]:
    """(E, 2) edges that belong to one triangle only, in the direction of that triangle."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    _, index, counts = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(edges[index[counts == 1]])


def _loop(edges: NDArray[np.intp]) -> NDArray[np.intp]:
    following = dict(edges.tolist())
    start = min(following)
    loop = [start]
    while following[loop[-1]] != start:
        loop.append(following[loop[-1]])
    if len(loop) != len(edges):
        raise ValueError(f"the cut has {len(edges)} edges, but one loop has {len(loop)}: move the cutting plane")
    return np.array(loop)


def close(skin: Skin, vertices: NDArray[np.float64], normal: NDArray[np.float64]) -> Skin:
    """Add the rings below the rim, each a copy of the rim moved inwards and down, and one vertex in the middle."""
    rim = skin.rim
    at = skin.positions(vertices)
    centre = at[rim].mean(0)
    inwards = centre - at[rim]
    inwards /= np.linalg.norm(inwards, axis=1, keepdims=True)
    count, size = len(at), len(rim)
    offsets, triangles = [skin.offset], [skin.triangles]
    previous = rim
    for depth, inset in BASE_RINGS_M:
        offsets.append(skin.offset[rim] + inset * inwards - depth * normal)
        ring = count + np.arange(size)
        triangles.append(_band(previous, ring))
        previous, count = ring, count + size
    triangles.append(np.stack([np.roll(previous, -1), previous, np.full(size, count)], axis=1))
    offsets.append(centre - BASE_RINGS_M[-1][0] * normal - skin.lift[rim[:1]] @ vertices)
    lift = sparse.vstack([skin.lift, *[skin.lift[rim]] * len(BASE_RINGS_M), skin.lift[rim[:1]]], format="csr")
    rim_uv = _rim_uv(skin)
    base_uv = np.concatenate([np.tile(rim_uv[:, [1, 0, 0]], (1, 1, 1)), rim_uv[:, [1, 0, 1]]], axis=1).reshape(-1, 3, 2)
    cap_uv = rim_uv[:, [1, 0, 0]]
    uv = np.concatenate([skin.uv, *[base_uv] * len(BASE_RINGS_M), cap_uv])
    return Skin(lift, np.concatenate(offsets), np.concatenate(triangles), uv, rim)


def _band(upper: NDArray[np.intp], lower: NDArray[np.intp]) -> NDArray[np.intp]:
    """Two triangles for each edge of the rim: (2 R, 3)."""
    following = np.roll(upper, -1), np.roll(lower, -1)
    first = np.stack([following[0], upper, lower], axis=1)
    second = np.stack([following[0], lower, following[1]], axis=1)
    return np.stack([first, second], axis=1).reshape(-1, 3)


def _rim_uv(skin: Skin) -> NDArray[np.float64]:
    """(R, 2, 2) texture coordinates of the start and end of every edge of the rim, from the triangle above it."""
    corner = {}
    for triangle, uv in zip(skin.triangles.tolist(), skin.uv, strict=True):
        for k in range(3):
            corner[triangle[k], triangle[(k + 1) % 3]] = uv[k], uv[(k + 1) % 3]
    ahead = np.roll(skin.rim, -1)
    return np.array([corner[int(a), int(b)] for a, b in zip(skin.rim, ahead, strict=True)])
