"""A shell of hair over the scalp, modelled like clay: thick where the hairdo says so, with combed locks, its border
sunk into the skin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe.atlas import pack
from rigs.recipe.complexion import above_hairline, hair_cover
from rigs.recipe.noise import fractal, value_noise
from rigs.recipe.paint import canvas, smoothstep
from rigs.recipe.part import Part, rigid, vertex_normals
from rigs.recipe.refine import refine
from rigs.recipe.skeleton import HEAD

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.palette import Palette
    from rigs.recipe.person import Person
    from rigs.recipe.skeleton import Skeleton
    from rigs.recipe.skin import Skin

    Field = NDArray[np.float64]

PICTURE_SIZE = 512
EDGES_M = (0.009, 0.006)
"""The scalp is split until its edges are no longer than this."""
SUNK_M = 0.0025
STEEP_M = 0.014
"""The shell rises to its full height within so much of the hairline."""


@dataclass(frozen=True, slots=True)
class Hairdo:
    """Heights of the shell over the scalp [m]."""

    side_m: float
    top_m: float
    quiff_m: float
    """Above the forehead, on top of the rest."""
    locks_m: float
    """Depth of the furrows between locks."""
    lock_size_m: float
    sweep: float
    """How far the locks lean to the character's left on their way back, metres a metre."""


def hair(
    hairdo: Hairdo, skin: Skin, person: Person, skeleton: Skeleton, palette: Palette
) -> tuple[Part, NDArray[np.uint8]]:
    """The shell, which follows the head, and its picture."""
    for longest in EDGES_M:
        skin = refine(skin, person.vertices, longest)
    place = person.on_canvas(skin)
    scalp = skin.positions(person.vertices)
    normals = vertex_normals(scalp, skin.triangles)
    lock = _locks(hairdo, place)
    bare = smoothstep(0.02, 0.6, hair_cover(place, _source_uv(skin)))
    rise = np.sqrt(smoothstep(0.0, STEEP_M, above_hairline(place))) * bare
    height = rise * (_thickness(hairdo, place) - hairdo.locks_m * lock) - SUNK_M * (1 - rise)
    shell = scalp + normals * height[:, None] + _brushed(hairdo, place, rise)
    kept = (above_hairline(place)[skin.triangles] > -0.004).all(1) & (bare[skin.triangles] > 0).any(1)
    triangles = skin.triangles[kept]
    uv = pack(skin.uv)[kept]
    layer = canvas(uv, PICTURE_SIZE)
    texels = layer.sample(place[triangles]), layer.sample(lock[triangles]), layer.sample(rise[triangles])
    picture = layer.picture(_colours(palette, hairdo, *texels))
    return _part(shell, triangles, uv, skeleton.index(HEAD)), picture


def _source_uv(skin: Skin) -> Field:
    uv = np.zeros((skin.lift.shape[0], 2))
    uv[skin.triangles] = skin.uv
    return uv


def _thickness(hairdo: Hairdo, place: Field) -> Field:
    x, y, z = place.T
    up = smoothstep(0.01, 0.10, y)
    front = np.exp(-(((x - 0.012) / 0.045) ** 2) - ((y - 0.085) / 0.035) ** 2 - ((z + 0.005) / 0.05) ** 2)
    return np.asarray(hairdo.side_m + (hairdo.top_m - hairdo.side_m) * up + hairdo.quiff_m * front)


def _locks(hairdo: Hairdo, place: Field) -> Field:
    """(N,) in [0, 1]: 1 in the furrows. Locks run back over the head, and down at its sides."""
    x, y, z = place.T
    around = np.arctan2(x - hairdo.sweep * z, y + 0.02) * 0.1
    run = np.stack([around, 0.12 * np.hypot(y, z), 0.02 * np.sign(x)], axis=1)
    bend = 0.25 * fractal(place, 0.03, 2, seed=101) * hairdo.lock_size_m
    furrow = 1 - np.abs(value_noise(run + bend[:, None], hairdo.lock_size_m, seed=102))
    return np.asarray(furrow**2)


def _brushed(hairdo: Hairdo, place: Field, rise: Field) -> Field:
    """(N, 3) [m]: the quiff is combed up and to the character's left."""
    x, y, z = place.T
    front = np.exp(-((x / 0.05) ** 2) - ((y - 0.09) / 0.03) ** 2 - ((z - 0.005) / 0.04) ** 2) * rise
    return np.asarray(front[:, None] * hairdo.quiff_m * np.array([0.35, 0.55, 0.25]))


def _colours(palette: Palette, hairdo: Hairdo, place: Field, lock: Field, rise: Field) -> Field:
    x, y, z = place.T * 1e3
    around = np.arctan2(x - hairdo.sweep * z, y + 20) * 100
    strands = value_noise(np.stack([around, 0.06 * np.hypot(y, z), 3 * np.sign(x)], axis=1), 1.3, seed=103)
    light = 1.12 - 0.45 * lock + 0.10 * strands + 0.08 * fractal(place * 1e3, 30, 2, seed=104)
    light = light * (0.72 + 0.28 * rise) * (0.85 + 0.25 * smoothstep(-40, 110, y))
    return np.asarray(np.array(palette.hair) * light[:, None])


def _part(positions: Field, triangles: NDArray[np.intp], uv: Field, joint: int) -> Part:
    """One vertex for every pair of place and texture coordinate, without those that no triangle uses."""
    normals = vertex_normals(positions, triangles)
    corners = np.column_stack([triangles.reshape(-1, 1), np.round(uv.reshape(-1, 2), 6)])
    unique, index = np.unique(corners, axis=0, return_inverse=True)
    vertex = unique[:, 0].astype(int)
    return Part(
        "hair",
        positions[vertex],
        normals[vertex],
        unique[:, 1:],
        index.reshape(-1, 3),
        *rigid(len(vertex), joint),
        {},
    )
