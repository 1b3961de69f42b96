"""Teeth and gums along two dental arches, and the tongue.

Widths of the teeth are the usual anatomical means (Wheeler's Dental Anatomy, tables of crown dimensions). Teeth and tongue share one picture: teeth in its upper half, from the midline (left)
to the last molar (right), the tongue in its lower half.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe.part import Part, rigid, vertex_normals

if TYPE_CHECKING:
    from numpy.typing import NDArray

COLUMNS = 5
"""Columns of vertices for each tooth."""


@dataclass(frozen=True, slots=True)
class Arch:
    """A row of teeth; metres. `rise` is +1 where the crowns hang down from the gum, -1 where they stand up."""

    widths_mm: tuple[float, ...]
    crown_mm: tuple[float, ...]
    half_width: float
    depth: float
    rise: int


UPPER = Arch((8.4, 6.6, 7.6, 7.0, 6.6, 10.0, 9.5), (10.0, 8.8, 9.8, 8.4, 8.0, 7.4, 7.0), 0.0275, 0.044, 1)
LOWER = Arch((5.4, 5.9, 6.8, 7.0, 7.0, 11.0, 10.5), (8.6, 9.0, 10.0, 8.4, 8.0, 7.4, 7.0), 0.0255, 0.042, -1)

_ROWS = (
    # (height in crowns from the cutting edge, outwards in mm, texture row)
    (1.75, -1.6, 0.00),
    (1.25, 0.3, 0.18),
    (1.00, 0.0, 0.34),
    (0.55, 0.55, 0.60),
    (0.12, 0.15, 0.86),
    (0.00, -0.7, 0.92),
    (0.12, -1.8, 0.96),
    (1.00, -4.5, 1.00),
)


def teeth(name: str, arch: Arch, front: NDArray[np.float64], joint: int) -> Part:
    """The teeth of one arch; `front` (3,) [m] is the middle of the cutting edge."""
    place, phase, crown = _columns(arch)
    half = len(place)
    side = np.r_[-np.ones(half - 1), np.ones(half)]
    fold = np.r_[np.arange(half - 1, 0, -1), np.arange(half)]
    centre, outwards = _along(arch, place)
    centre, outwards = centre[fold] * np.c_[side, np.ones(len(side))], outwards[fold] * np.c_[side, np.ones(len(side))]
    phase, crown, place = phase[fold], crown[fold], place[fold] / place[-1]
    gap = np.abs(2 * phase - 1) ** 5
    positions, uv = [], []
    for height, bulge, row in _ROWS:
        scallop = 0.12 * gap if 0.5 < height < 1.5 else 0.0
        cut = 0.9 * gap if height < 0.2 else 0.0
        out = bulge - 1.1 * gap * (height < 1.1) - 0.4 * place
        thick = 1 + 1.2 * np.clip((place - 0.4) * 2.5, 0, 1) * (bulge < -1 and height < 1.5)
        flat = centre + outwards * (out * thick)[:, None] * 1e-3
        up = arch.rise * (crown * (height - scallop) + cut) * 1e-3
        positions.append(np.stack([flat[:, 0], up, flat[:, 1]], axis=1) + front)
        uv.append(np.stack([place, np.full(len(place), 0.5 * row)], axis=1))
    triangles = _grid_triangles(len(_ROWS), len(side))
    triangles = triangles if arch.rise > 0 else triangles[:, ::-1]
    at = np.concatenate(positions)
    return Part(name, at, vertex_normals(at, triangles), np.concatenate(uv), triangles, *rigid(len(at), joint), {})


def _columns(arch: Arch) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Arc length [m], phase in [0, 1] across the tooth and crown height [mm] of every column from the midline back."""
    edges = np.cumsum([0.0, *arch.widths_mm]) * 1e-3
    place, phase, crown = [0.0], [0.0], [arch.crown_mm[0]]
    for tooth, (start, end) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
        for k in range(1, COLUMNS + 1):
            place.append(start + (end - start) * k / COLUMNS)
            phase.append(k / COLUMNS)
            crown.append(arch.crown_mm[tooth])
    return np.array(place), np.array(phase), np.array(crown)


def _along(arch: Arch, place: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (N, 2) of the arch in x and z [m], its front at the origin, and unit vectors outwards."""
    angle = np.linspace(0, np.pi / 2 * 1.25, 2000)
    x, z = arch.half_width * np.sin(np.minimum(angle, np.pi / 2)), arch.depth * (np.cos(angle) - 1)
    length = np.r_[0, np.cumsum(np.hypot(np.diff(x), np.diff(z)))]
    points = np.stack([np.interp(place, length, x), np.interp(place, length, z)], axis=1)
    tangent = np.gradient(points, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return points, np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)


def _grid_triangles(rows: int, columns: int) -> NDArray[np.intp]:
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    below, right, across = corner + columns, corner + 1, corner + columns + 1
    return np.concatenate([np.stack([corner, below, right], 1), np.stack([right, below, across], 1)])
