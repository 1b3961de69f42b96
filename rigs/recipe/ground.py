"""Survey the skin before it is painted: what lies under every texel of the picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe.atlas import inner, islands
from rigs.recipe.complexion import Ground
from rigs.recipe.occlusion import openness, smooth
from rigs.recipe.paint import look_up
from rigs.recipe.part import vertex_normals
from rigs.recipe.weights import surface_distance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.paint import Canvas
    from rigs.recipe.skin import Skin

FRONT_M = -0.02
"""Brows grow only in front of this plane, measured from the eyes."""


def survey(layer: Canvas, skin: Skin, place: NDArray[np.float64], lip_mask: NDArray[np.float64]) -> Ground:
    """What the painter knows, for skin vertices `place` (V, 3) [m] from the middle between the eyes."""
    triangles = skin.triangles
    island = islands(skin.uv)
    lids = island["socketLeft"] | island["socketRight"]
    depth = surface_distance(place, triangles, np.unique(triangles[~island["mouth"]]))
    rim = surface_distance(place, triangles, np.intersect1d(triangles[lids], triangles[~lids]))
    light = smooth(openness(place, triangles, vertex_normals(place, triangles)), triangles, 2)
    source_uv = layer.sample(skin.uv)
    at = layer.sample(place[triangles])
    return Ground(
        place=at,
        openness=layer.sample(light[triangles]),
        lips=look_up(lip_mask, source_uv),
        source_uv=source_uv,
        mouth_m=layer.sample(depth[triangles]) * island["mouth"][layer.triangle],
        rim_m=layer.sample(rim[triangles]),
        socket=lids[layer.triangle].astype(float),
        outside=(~inner(skin.uv)[layer.triangle] & (at[:, 2] > FRONT_M)).astype(float),
    )
