"""Split the long edges of the skin, so that the skull is round in profile, and give the hair some thickness.

The new vertex of an edge lies on the cubic curve that the normals of its ends ask for: Vlachos, Peters, Boyd,
Mitchell: Curved PN Triangles, I3D 2001, section 3.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from rigs.recipe.part import vertex_normals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.skin import Skin

UNSPLIT = -1


def refine(skin: Skin, base: NDArray[np.float64], longest_m: float) -> Skin:
    """Split every edge longer than `longest_m`, but none of the rim, once."""
    positions = skin.positions(base)
    edges = np.concatenate([skin.triangles[:, [0, 1]], skin.triangles[:, [1, 2]], skin.triangles[:, [2, 0]]])
    edges, uses = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    length = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1)
    split = edges[(length > longest_m) & (uses == 2)]
    number = {(a, b): len(positions) + k for k, (a, b) in enumerate(split.tolist())}
    triangles: list[list[int]] = []
    uv: list[list[NDArray[np.float64]]] = []
    for triangle, corners in zip(skin.triangles.tolist(), skin.uv, strict=True):
        middles = [number.get(_sorted(triangle[k], triangle[(k + 1) % 3]), UNSPLIT) for k in range(3)]
        for pattern in _pattern([middle != UNSPLIT for middle in middles]):
            triangles.append([(triangle + middles)[k] for k in pattern])
            uv.append([_corner(corners, k) for k in pattern])
    half = sparse.csr_array(
        (np.full(2 * len(split), 0.5), (np.arange(len(split)).repeat(2), split.ravel())), (len(split), len(positions))
    )
    lift = sparse.vstack([skin.lift, half @ skin.lift], format="csr")
    bulge = _curve_middles(positions, vertex_normals(positions, skin.triangles), split) - half @ skin.lift @ base
    return replace(
        skin, lift=lift, offset=np.vstack([skin.offset, bulge]), triangles=np.array(triangles), uv=np.array(uv)
    )


def _sorted(a: int, b: int) -> tuple[int, int]:
    return (a, b) if a < b else (b, a)


def _corner(corners: NDArray[np.float64], k: int) -> NDArray[np.float64]:
    return np.asarray(corners[k] if k < 3 else (corners[k - 3] + corners[(k - 2) % 3]) / 2)


def _pattern(split: list[bool]) -> list[tuple[int, int, int]]:
    """Triangles over the corners 0 to 2 and the middles 3 to 5 of the edges (01), (12), (20)."""
    count = sum(split)
    if count == 0:
        return [(0, 1, 2)]
    if count == 3:
        return [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]
    turn = split.index(True) if count == 1 else (split.index(False) + 1) % 3
    first = [(0, 3, 2), (3, 1, 2)] if count == 1 else [(3, 1, 4), (0, 3, 4), (0, 4, 2)]
    return [(_turned(a, turn), _turned(b, turn), _turned(c, turn)) for a, b, c in first]


def _turned(k: int, turn: int) -> int:
    return (k + turn) % 3 if k < 3 else 3 + (k - 3 + turn) % 3


def _curve_middles(
    positions: NDArray[np.float64], normals: NDArray[np.float64], edges: NDArray[np.intp]
) -> NDArray[np.float64]:
    """(E, 3) middles of the cubic curves over the edges."""
    a, b = positions[edges[:, 0]], positions[edges[:, 1]]
    lift_a = ((b - a) * normals[edges[:, 0]]).sum(1, keepdims=True) * normals[edges[:, 0]]
    lift_b = ((a - b) * normals[edges[:, 1]]).sum(1, keepdims=True) * normals[edges[:, 1]]
    return np.asarray((a + b) / 2 - (lift_a + lift_b) / 8)


def thicken(skin: Skin, base: NDArray[np.float64], height: NDArray[np.float64]) -> Skin:
    """Move every vertex outwards by `height` (V,) [m]."""
    normals = vertex_normals(skin.positions(base), skin.triangles)
    return replace(skin, offset=skin.offset + height[:, None] * normals)
