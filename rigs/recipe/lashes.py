"""Lashes: single hairs as slim opaque triangles, standing on MakeHuman's lash strips, which the blink shapes turn with
the lids.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

if TYPE_CHECKING:
    from numpy.typing import NDArray


def strip_grid(quads: NDArray[np.intp], root_distance: NDArray[np.float64]) -> NDArray[np.intp]:
    """The vertices of a strip of quads as a grid (rows, columns); row 0 is the long side of smallest `root_distance`
    (V,).
    """
    neighbours: dict[int, set[int]] = {}
    uses = np.bincount(quads.ravel())
    for quad in quads.tolist():
        for a, b in zip(quad, quad[1:] + quad[:1], strict=True):
            neighbours.setdefault(a, set()).add(b)
            neighbours.setdefault(b, set()).add(a)
    corners = [vertex for vertex in neighbours if uses[vertex] == 1]
    sides = sorted((_side(corner, neighbours, uses) for corner in corners), key=lambda side: root_distance[side].mean())
    rows = [sides[0]]
    used = set(sides[0])
    while following := [next((n for n in neighbours[v] if n not in used), -1) for v in rows[-1]]:
        if -1 in following:
            break
        rows.append(following)
        used.update(following)
    return np.array(rows)


def _side(corner: int, neighbours: dict[int, set[int]], uses: NDArray[np.intp]) -> list[int]:
    """The longer side of the strip that starts at `corner`."""
    sides = []
    for step in sorted(neighbours[corner]):
        side = [corner, step]
        while uses[side[-1]] == 2:
            side.append(next(n for n in neighbours[side[-1]] if uses[n] <= 2 and n != side[-2]))
        sides.append(side)
    return max(sides, key=len)


def hairs(
    grid: NDArray[np.intp], count: int, length: float, base: int, rng: np.random.Generator
) -> tuple[sparse.csr_array, NDArray[np.intp]]:
    """`count` hairs along a strip: weights (5 count, base) of the strip's vertices, and triangles (3 count, 3).

    `length` is the part of the strip's width that the longest hair covers; the hairs bend outwards towards the outer
    corner.
    """
    columns = grid.shape[1] - 1
    rows, weights = [], []
    for hair in range(count):
        along = (hair + 0.5 + rng.uniform(-0.3, 0.3)) / count
        reach = length * (0.55 + 0.45 * np.sin(np.pi * (0.12 + 0.8 * along))) * rng.uniform(0.85, 1.1)
        lean = rng.uniform(-0.012, 0.012)
        half = 0.32 / count
        for across, offset in ((0.0, -half), (0.0, half), (0.5, -0.6 * half), (0.5, 0.6 * half), (1.0, 0.0)):
            at = np.clip(along + offset + lean * across, 0, 1) * columns
            rows.append(at)
            weights.append(across * reach * (grid.shape[0] - 1))
    lift = _interpolate(grid, np.array(weights), np.array(rows), base)
    first = 5 * np.arange(count)[:, None]
    triangles = np.concatenate([first + np.array(hair) for hair in ((0, 1, 3), (0, 3, 2), (2, 3, 4))])
    return lift, triangles


def _interpolate(
    grid: NDArray[np.intp], row: NDArray[np.float64], column: NDArray[np.float64], base: int
) -> sparse.csr_array:
    """Bilinear weights (N, base) at fractional grid places."""
    r, c = (
        np.minimum(place.astype(np.intp), size - 2) for place, size in ((row, grid.shape[0]), (column, grid.shape[1]))
    )
    fr, fc = row - r, column - c
    corners = [grid[r, c], grid[r, c + 1], grid[r + 1, c], grid[r + 1, c + 1]]
    shares = [(1 - fr) * (1 - fc), (1 - fr) * fc, fr * (1 - fc), fr * fc]
    count = np.tile(np.arange(len(row)), 4)
    return sparse.csr_array((np.concatenate(shares), (count, np.concatenate(corners))), shape=(len(row), base))
