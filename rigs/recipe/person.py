"""The person: MakeHuman's targets mixed to one identity, and all that is known of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe.eyes import fit_sphere
from rigs.recipe.identity import HUMAN
from rigs.recipe.shapes import ARKIT
from rigs.recipe.warp import apply_warp

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rigs.recipe.identity import Identity
    from rigs.recipe.skin import Skin
    from rigs.recipe.source import BaseMesh, Wheel
    from rigs.recipe.warp import Bulge

EYES = {"eyeLeft": "helper-l-eye", "eyeRight": "helper-r-eye"}
"""Joint of each eye, and the group of MakeHuman's eyeball."""


@dataclass(frozen=True, slots=True, eq=False)
class Person:
    """The base mesh in the shape of this person."""

    identity: Identity
    mesh: BaseMesh
    vertices: NDArray[np.float64]
    """(B, 3) [m], of the body and of the helper geometry."""
    canvas: NDArray[np.float64]
    """(B, 3) [m], the same vertices of the default identity, where colours are told."""
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

    def on_canvas(self, skin: Skin) -> NDArray[np.float64]:
        """Where the vertices (V, 3) [m] of the skin are on the default identity, from the middle between its eyes."""
        default = replace(self, vertices=self.canvas)
        return skin.positions(default.vertices) - default.eye_middle()

    def units_of(self, vertices: NDArray[np.intp]) -> dict[str, NDArray[np.float64]]:
        """The units that move any of these vertices, offsets (N, 3) [m]."""
        return {name: offsets[vertices] for name, offsets in self.units.items() if offsets[vertices].any()}

    def moved(self, shift: NDArray[np.float64]) -> Person:
        """The person elsewhere."""
        return replace(self, vertices=self.vertices + shift, canvas=self.canvas + shift)


def person(wheel: Wheel, identity: Identity) -> Person:
    """The person of this identity, in the frame of the base mesh."""
    mesh = wheel.mesh()
    count = len(mesh.vertices)
    vertices = _mixed(wheel, mesh, identity)
    units = {name: wheel.face_unit(name, count) for name in ARKIT}
    middles = [vertices[np.unique(mesh.quads[mesh.groups == bulge.about])].mean(0) for bulge in identity.warp]
    bulges = tuple(zip(identity.warp, middles, strict=True))
    if bulges:
        warped = apply_warp(bulges, vertices)
        units = {name: _warped_unit(bulges, vertices, warped, unit) for name, unit in units.items()}
        vertices = warped
    canvas = vertices if identity is HUMAN else _mixed(wheel, mesh, HUMAN)
    return Person(identity, mesh, vertices, canvas, units)


def _mixed(wheel: Wheel, mesh: BaseMesh, identity: Identity) -> NDArray[np.float64]:
    vertices = mesh.vertices.copy()
    for name, weight in (*identity.macro().items(), *identity.details.items()):
        vertices += weight * wheel.target(name, len(vertices))
    return vertices


def _warped_unit(
    bulges: Sequence[tuple[Bulge, NDArray[np.float64]]],
    before: NDArray[np.float64],
    warped: NDArray[np.float64],
    unit: NDArray[np.float64],
) -> NDArray[np.float64]:
    """What the warp makes of the way (B, 3) that a shape goes."""
    moved = np.flatnonzero(unit.any(axis=1))
    offsets = np.zeros_like(unit)
    offsets[moved] = apply_warp(bulges, before[moved] + unit[moved]) - warped[moved]
    return offsets
