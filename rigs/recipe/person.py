"""The person: MakeHuman's targets mixed to one pleasant, neutral adult of no particular origin, and all that is known
of them.

Macro targets are weighted as MakeHuman does: origin x sex x age, and sex x age x muscle x weight.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe.eyes import fit_sphere
from rigs.recipe.shapes import ARKIT

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
EYES = {"eyeLeft": "helper-l-eye", "eyeRight": "helper-r-eye"}
"""Joint of each eye, and the group of MakeHuman's eyeball."""


@dataclass(frozen=True, slots=True, eq=False)
class Person:
    """The base mesh in the shape of this person."""

    mesh: BaseMesh
    vertices: NDArray[np.float64]
    """(B, 3) [m], of the body and of the helper geometry."""
    units: dict[str, NDArray[np.float64]]
    """The face units by ARKit's names, offsets (B, 3) [m]."""

    def group(self, name: str) -> NDArray[np.intp]:
        """Numbers of the vertices of exactly this group, ascending."""
        return np.unique(self.mesh.quads[self.mesh.groups == name])

    def eyes(self) -> dict[str, NDArray[np.float64]]:
        """Centre (3,) [m] of each eyeball, by the name of its joint."""
        return {joint: fit_sphere(self.vertices[self.group(group)])[0] for joint, group in EYES.items()}

    def eye_middle(self) -> NDArray[np.float64]:
        """The middle (3,) [m] between the eyes, from which places on the face are measured."""
        return np.asarray(np.mean(list(self.eyes().values()), axis=0))

    def units_of(self, vertices: NDArray[np.intp]) -> dict[str, NDArray[np.float64]]:
        """The units that move any of these vertices, offsets (N, 3) [m]."""
        return {name: offsets[vertices] for name, offsets in self.units.items() if offsets[vertices].any()}

    def moved(self, shift: NDArray[np.float64]) -> Person:
        """The person elsewhere."""
        return replace(self, vertices=self.vertices + shift)


def person(wheel: Wheel) -> Person:
    """The default rig's person, in the frame of the base mesh."""
    mesh = wheel.mesh()
    count = len(mesh.vertices)
    vertices = mesh.vertices.copy()
    for name, weight in (*_macro().items(), *DETAILS.items()):
        vertices += weight * wheel.target(name, count)
    return Person(mesh, vertices, {name: wheel.face_unit(name, count) for name in ARKIT})


def _macro() -> dict[str, float]:
    sexes = {"male": MALE, "female": 1 - MALE}
    targets = {
        f"macrodetails/{origin}-{sex}-young": share * part
        for origin, share in ORIGINS.items()
        for sex, part in sexes.items()
    }
    build = {f"macrodetails/universal-{sex}-young-averagemuscle-averageweight": part for sex, part in sexes.items()}
    return targets | build
