"""Lay the skin out for painting: MakeHuman's texture islands of the head, turned upright and packed into one square.

The face gets most of the picture: columns are stretched towards the middle by u' = (1 + c) u / (1 + c |u|). Afterwards texture coordinates
follow glTF, (0, 0) in the upper left corner.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

if TYPE_CHECKING:
    from numpy.typing import NDArray

STRETCH = 0.9
Box = tuple[float, float, float, float]
"""left, top, right, bottom."""


@dataclass(frozen=True, slots=True)
class Island:
    """Where an island lies in MakeHuman's layout (a point inside its box tells it), and where it goes."""

    name: str
    source: Box
    goal: Box
    upright: bool = False
    stretch: float = 0.0


ISLANDS = (
    Island("face", (0.60, 0.14, 1.00, 0.83), (0.004, 0.004, 0.996, 0.83), upright=True, stretch=STRETCH),
    Island("neck", (0.20, 0.86, 0.55, 1.00), (0.004, 0.84, 0.55, 0.996)),
    Island("mouth", (0.74, 0.00, 0.95, 0.14), (0.56, 0.84, 0.77, 0.996)),
    Island("socketRight", (0.00, 0.54, 0.08, 0.64), (0.78, 0.84, 0.88, 0.996)),
    Island("socketLeft", (0.08, 0.54, 0.16, 0.64), (0.89, 0.84, 0.99, 0.996)),
)

INNER_ISLANDS = 2
"""From this one on, the islands lie inside the head."""


def island_of(uv: NDArray[np.float64]) -> NDArray[np.intp]:
    """The number of the island of each triangle, for corners (F, 3, 2) in MakeHuman's layout."""
    middle = uv.mean(1)
    island = np.full(len(uv), -1)
    for number, entry in enumerate(ISLANDS):
        left, low, right, high = entry.source
        inside = (middle[:, 0] > left) & (middle[:, 0] < right) & (middle[:, 1] > low) & (middle[:, 1] < high)
        island[inside] = number
    if (island < 0).any():
        raise ValueError(f"{(island < 0).sum()} triangles lie outside every known island")
    return island


def pack(uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners (F, 3, 2) in MakeHuman's layout to the picture's (origin in the upper left)."""
    island = island_of(uv)
    packed = np.empty_like(uv)
    for number, entry in enumerate(ISLANDS):
        chosen = island == number
        place = uv[chosen]
        low, high = place.min((0, 1)), place.max((0, 1))
        unit = (place - low) / (high - low)
        unit = unit[..., ::-1] if entry.upright else np.stack([unit[..., 0], 1 - unit[..., 1]], axis=-1)
        across = 2 * unit[..., 0] - 1
        unit[..., 0] = 0.5 + 0.5 * (1 + entry.stretch) * across / (1 + entry.stretch * np.abs(across))
        left, top, right, bottom = entry.goal
        packed[chosen] = [left, top] + unit * [right - left, bottom - top]
    return packed
