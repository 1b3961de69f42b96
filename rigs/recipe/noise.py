"""Smooth random fields in space, the same on every machine: lattice values blended by a cubic step (Perlin's value
noise).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_TABLE = 256


def value_noise(points: NDArray[np.float64], size: float, seed: int) -> NDArray[np.float64]:
    """Values (...) in [-1, 1] at points (..., 3); `size` is the distance between independent values, in their unit."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(_TABLE)
    values = rng.uniform(-1, 1, _TABLE)
    place = np.asarray(points, dtype=float) / size
    cell = np.floor(place).astype(np.intp)
    step = place - cell
    step = step * step * (3 - 2 * step)
    total = np.zeros(place.shape[:-1])
    for corner in np.ndindex(2, 2, 2):
        lattice = (cell + corner) % _TABLE
        index = order[(order[(order[lattice[..., 0]] + lattice[..., 1]) % _TABLE] + lattice[..., 2]) % _TABLE]
        share = np.where(np.array(corner, dtype=bool), step, 1 - step).prod(axis=-1)
        total += share * values[index]
    return total


def fractal(points: NDArray[np.float64], size: float, octaves: int, seed: int) -> NDArray[np.float64]:
    """Sum of `octaves` fields, each half as large and half as strong as the one before; about [-1, 1]."""
    layers = [value_noise(points, size / 2**k, seed + k) / 2**k for k in range(octaves)]
    return np.asarray(np.sum(layers, axis=0))
