"""The eyeballs: two spheres with a cornea, turned by the joints ``eyeLeft`` and ``eyeRight`` and by the ``eyeLook...``
shapes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.geometry import kabsch
from rigs.recipe.part import Part, rigid, vertex_normals

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

SHRINK = 0.92
"""Against MakeHuman's eyeball, which reaches through the edges of the lids."""
CORNEA_M = 0.0006
SEGMENTS = 28
RINGS_DEG = (4.0, 9.0, 13.0, 17.0, 21.0, 25.5, 30.0, 36.0, 43.0, 52.0, 62.0, 74.0, 88.0, 104.0)
"""Angles from the front at which the sphere has a ring; what lies behind is never seen."""


def fit_sphere(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Centre (3,) and radius of the sphere through `points` (N, 3) [m], least squares in the algebraic distance."""
    system = np.column_stack([2 * points, np.ones(len(points))])
    *centre, rest = np.linalg.lstsq(system, (points**2).sum(1), rcond=None)[0]
    middle = np.array(centre)
    return middle, float(np.sqrt(rest + middle @ middle))


def eyeball(
    name: str, helper: NDArray[np.float64], moved: Mapping[str, NDArray[np.float64]], joint: int, iris_deg: float
) -> Part:
    """One eye in the place of MakeHuman's helper sphere (N, 3) [m].

    `moved` holds where every shape takes the vertices of that sphere; its rigid part is what the new eye does.
    """
    centre, radius = fit_sphere(helper)
    directions, angles = _directions()
    bulge = CORNEA_M * np.clip(1 - (np.degrees(angles) / (iris_deg + 3)) ** 2, 0, None) ** 1.5
    positions = centre + directions * (SHRINK * radius + bulge)[:, None]
    triangles = _triangles()
    reach = 0.5 * angles / np.radians(RINGS_DEG[-1])
    around = directions[:, :2] / np.maximum(np.linalg.norm(directions[:, :2], axis=1, keepdims=True), 1e-12)
    uv = 0.5 + reach[:, None] * around * [1, -1]
    shapes = {}
    for shape, target in moved.items():
        R = kabsch(helper - centre, target - centre)[:3, :3]
        shapes[shape] = (positions - centre) @ R.T + centre - positions
    return Part(
        name, positions, vertex_normals(positions, triangles), uv, triangles, *rigid(len(positions), joint), shapes
    )


def _directions() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit vectors (V, 3), the front first and then ring by ring, and their angles (V,) from the front."""
    polar = np.radians(np.repeat(RINGS_DEG, SEGMENTS))
    turn = np.tile(np.arange(SEGMENTS) * (2 * np.pi / SEGMENTS), len(RINGS_DEG))
    rings = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=1)
    return np.vstack([[0.0, 0.0, 1.0], rings]), np.r_[0.0, polar]


def _triangles() -> NDArray[np.intp]:
    here = np.arange(SEGMENTS)
    ahead = np.roll(here, -1)
    front = np.stack([np.zeros_like(here), 1 + here, 1 + ahead], axis=1)
    bands = [front]
    for ring in range(len(RINGS_DEG) - 1):
        inner, outer = 1 + ring * SEGMENTS, 1 + (ring + 1) * SEGMENTS
        bands.append(np.stack([inner + here, outer + here, outer + ahead], axis=1))
        bands.append(np.stack([inner + here, outer + ahead, inner + ahead], axis=1))
    return np.concatenate(bands)
