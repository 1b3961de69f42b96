"""How open each vertex lies to the light from all around: depth maps from many directions, compared with the vertex's
own depth.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

if TYPE_CHECKING:
    from numpy.typing import NDArray

DIRECTIONS = 90
PIXEL_M = 0.0012
BIAS_M = 0.0012
"""A vertex is lit where nothing lies nearer to the light than this."""


def openness(
    positions: NDArray[np.float64], triangles: NDArray[np.intp], normals: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(V,) in [0, 1]: the share of the light from above its own horizon, weighted by the cosine, that reaches each
    vertex.
    """
    received, possible = np.zeros(len(positions)), np.zeros(len(positions))
    for light in _sphere(DIRECTIONS):
        cosine = np.maximum(normals @ light, 0)
        received += cosine * _lit(positions, triangles, light)
        possible += cosine
    return received / np.maximum(possible, 1e-9)


def smooth(values: NDArray[np.float64], triangles: NDArray[np.intp], rounds: int) -> NDArray[np.float64]:
    """Values (V,) averaged with those of the neighbours, `rounds` times."""
    for _ in range(rounds):
        total, count = np.array(values), np.ones(len(values))
        for k in range(3):
            np.add.at(total, triangles[:, k], values[triangles[:, (k + 1) % 3]])
            np.add.at(count, triangles[:, k], 1)
        values = total / count
    return values


def _sphere(count: int) -> NDArray[np.float64]:
    """Evenly spread unit vectors (count, 3) on a golden spiral."""
    height = 1 - (2 * np.arange(count) + 1) / count
    turn = np.arange(count) * np.pi * (3 - np.sqrt(5))
    radius = np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(turn), height, radius * np.sin(turn)], axis=1)


def _lit(
    positions: NDArray[np.float64], triangles: NDArray[np.intp], light: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(V,) 1 where the light from direction `light` reaches the vertex, else 0."""
    side = np.cross(light, [0.0, 1.0, 0.0] if abs(light[1]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    flat = positions @ np.stack([side, np.cross(light, side)], axis=1)
    depth = positions @ light
    low = flat.min(0) - 2 * PIXEL_M
    shape = tuple(np.ceil((flat.max(0) - low) / PIXEL_M).astype(int) + 3)
    nearest = np.full(shape, -np.inf)
    for share in _SAMPLES:
        point = np.einsum("s,fsd->fd", share, flat[triangles])
        cell = ((point - low) / PIXEL_M).round().astype(int)
        np.maximum.at(nearest, (cell[:, 0], cell[:, 1]), np.einsum("s,fs->f", share, depth[triangles]))
    nearest = ndimage.grey_closing(nearest, size=(3, 3))
    cell = ((flat - low) / PIXEL_M).round().astype(int)
    return np.asarray(nearest[cell[:, 0], cell[:, 1]] < depth + BIAS_M, dtype=float)


def _barycentric_samples(steps: int) -> NDArray[np.float64]:
    pairs = [(i, j) for i in range(steps + 1) for j in range(steps + 1 - i)]
    return np.array([(i / steps, j / steps, 1 - (i + j) / steps) for i, j in pairs])


_SAMPLES = _barycentric_samples(8)
