"""Teeth and gums along two dental arches, and the tongue.

Widths of the teeth are the usual anatomical means (Wheeler's Dental Anatomy, tables of crown dimensions). Teeth and
tongue share one picture: teeth in its upper half, from the midline (left) to the last molar (right), the tongue in its
lower half.
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

TONGUE_SCALE = (0.92, 0.66, 0.94)
TONGUE_SHIFT_M = (0.0, -0.0005, -0.002)
CREST = 0.34
"""Texture row where the gum ends."""
_ROWS = (
    # (height in crowns from the cutting edge, outwards in mm, texture row)
    (1.75, -1.6, 0.00),
    (1.25, 0.3, 0.18),
    (1.00, 0.0, CREST),
    (0.55, 0.55, 0.60),
    (0.12, 0.15, 0.86),
    (0.00, -0.7, 0.92),
    (0.12, -1.8, 0.96),
    (1.00, -4.5, 1.00),
)


def teeth(name: str, arch: Arch, front: NDArray[np.float64], joint: int, scale: float) -> Part:
    """The teeth of one arch, `scale` times an adult's; `front` (3,) [m] is the middle of the cutting edge."""
    columns = _columns(arch)
    half = len(columns.place)
    side = np.r_[-np.ones(half - 1), np.ones(half)]
    fold = np.r_[np.arange(half - 1, 0, -1), np.arange(half)]
    centre, outwards = (values[fold] * np.c_[side, np.ones(len(side))] for values in _along(arch, columns.place))
    gap = np.abs(2 * columns.phase[fold] - 1) ** 5
    back = columns.place[fold] / columns.place[-1]
    positions, uv = [], []
    for height, bulge, row in _ROWS:
        thick = 1 + 1.2 * np.clip((back - 0.4) * 2.5, 0, 1) * (bulge < -1 and height < 1.5)
        out = bulge * thick - 1.1 * gap * (height < 1.1) - 0.4 * back
        flat = centre + outwards * out[:, None] * 1e-3
        lowered = 0.12 * gap if 0.5 < height < 1.5 else 0.0
        rounded = 0.9 * gap if height < 0.2 else 0.0
        up = arch.rise * (columns.crown_mm[fold] * (height - lowered) + rounded) * 1e-3
        positions.append(scale * np.stack([flat[:, 0], up, flat[:, 1]], axis=1) + front)
        uv.append(np.stack([columns.picture[fold], np.full(len(fold), 0.5 * row)], axis=1))
    triangles = _grid_triangles(len(_ROWS), len(side))
    triangles = triangles if arch.rise > 0 else triangles[:, ::-1]
    at = np.concatenate(positions)
    return Part(name, at, vertex_normals(at, triangles), np.concatenate(uv), triangles, *rigid(len(at), joint), {})


@dataclass(frozen=True, slots=True, eq=False)
class _Columns:
    """Columns of vertices from the midline back; (C,) each."""

    place: NDArray[np.float64]
    """Arc length [m]."""
    phase: NDArray[np.float64]
    """0 to 1 across each tooth."""
    crown_mm: NDArray[np.float64]
    picture: NDArray[np.float64]
    """Column of the picture, in which every tooth has the width of the upper one."""


def _columns(arch: Arch) -> _Columns:
    phases = np.arange(1, COLUMNS + 1) / COLUMNS
    tooth = np.r_[0, np.repeat(np.arange(len(arch.widths_mm)), COLUMNS)]
    phase = np.r_[0, np.tile(phases, len(arch.widths_mm))]
    edges = np.cumsum([0.0, *arch.widths_mm]) * 1e-3
    painted = picture_edges()
    return _Columns(
        edges[tooth] + phase * np.diff(edges)[tooth],
        phase,
        np.array(arch.crown_mm)[tooth],
        painted[tooth] + phase * np.diff(painted)[tooth],
    )


def picture_edges() -> NDArray[np.float64]:
    """Where the teeth begin and end in the picture, from 0 (midline) to 1."""
    return np.cumsum([0.0, *UPPER.widths_mm]) / sum(UPPER.widths_mm)


def tongue(
    positions: NDArray[np.float64], triangles: NDArray[np.intp], joint: int, shapes: dict[str, NDArray[np.float64]]
) -> Part:
    """The tongue (V, 3) [m], root at the back, with its share of the picture; lies flatter than MakeHuman's, but comes
    out as high.
    """
    root = np.array([0.0, positions[:, 1].min(), positions[:, 2].min()])
    lowered = root + (positions - root) * TONGUE_SCALE + TONGUE_SHIFT_M
    out = np.linalg.norm(shapes["tongueOut"], axis=1, keepdims=True)
    shapes = shapes | {"tongueOut": shapes["tongueOut"] + out / out.max() * (positions - lowered)}
    positions = lowered
    low, high = positions.min(0), positions.max(0)
    unit = (positions - low) / (high - low)
    uv = np.stack([unit[:, 2], 0.52 + 0.46 * unit[:, 0]], axis=1)
    normals = vertex_normals(positions, triangles)
    return Part("tongue", positions, normals, uv, triangles, *rigid(len(positions), joint), shapes)


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
