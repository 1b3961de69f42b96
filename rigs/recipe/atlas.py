"""Lay the skin out for painting: MakeHuman's texture islands of the head, turned upright and packed into one square.

The face gets most of the picture: columns are stretched towards the middle by u' = (1 + c) u / (1 + c |u|). Afterwards
texture coordinates follow glTF, (0, 0) in the upper left corner.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

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


def islands(uv: NDArray[np.float64]) -> dict[str, NDArray[np.bool_]]:
    """For every island, which triangles lie on it, (F,); corners (F, 3, 2) in MakeHuman's layout."""
    x, y = uv.mean(1).T
    found = {
        entry.name: (x > entry.source[0]) & (y > entry.source[1]) & (x < entry.source[2]) & (y < entry.source[3])
        for entry in ISLANDS
    }
    missed = len(uv) - sum(int(inside.sum()) for inside in found.values())
    if missed:
        raise ValueError(f"{missed} triangles lie outside every known island")
    return found


def inner(uv: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(F,) which triangles lie inside the head: in the mouth or behind the lids."""
    found = islands(uv)
    return np.asarray(found["mouth"] | found["socketRight"] | found["socketLeft"])


def pack(uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners (F, 3, 2) in MakeHuman's layout to the picture's (origin in the upper left)."""
    found = islands(uv)
    packed = np.empty_like(uv)
    for entry in ISLANDS:
        place = uv[found[entry.name]]
        low, high = place.min((0, 1)), place.max((0, 1))
        unit = (place - low) / (high - low)
        unit = unit[..., ::-1] if entry.upright else np.stack([unit[..., 0], 1 - unit[..., 1]], axis=-1)
        across = 2 * unit[..., 0] - 1
        unit[..., 0] = 0.5 + 0.5 * (1 + entry.stretch) * across / (1 + entry.stretch * np.abs(across))
        left, top, right, bottom = entry.goal
        packed[found[entry.name]] = [left, top] + unit * [right - left, bottom - top]
    return packed
