"""What is set into the skin: eyeballs, teeth and tongue, lashes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from retarget.geometry import apply, kabsch
from rigs.recipe.eyes import eyeball
from rigs.recipe.lashes import hairs, strip_grid
from rigs.recipe.mouth import LOWER, UPPER, teeth, tongue
from rigs.recipe.part import Part, join, vertex_normals
from rigs.recipe.person import EYES
from rigs.recipe.skeleton import HEAD, JAW
from rigs.recipe.skin import triangulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.person import Person
    from rigs.recipe.skeleton import Skeleton

LASH_SEED = 7
EDGE_BELOW_HELPER_M, FRONT_BEHIND_HELPER_M = 0.0024, 0.0004
OVERBITE_M, OVERJET_M = 0.0012, 0.0026


def eyes_part(person: Person, skeleton: Skeleton) -> Part:
    """Both eyeballs."""
    parts = []
    for joint, group in EYES.items():
        vertices = person.group(group)
        at = person.vertices[vertices]
        moved = {shape: at + offsets for shape, offsets in person.units_of(vertices).items()}
        parts.append(eyeball(joint, at, moved, skeleton.index(joint), person.identity.proportions.iris_deg))
    return join("eyes", parts)


def mouth_part(person: Person, skeleton: Skeleton) -> Part:
    """Teeth and tongue."""
    head, jaw = skeleton.index(HEAD), skeleton.index(JAW)
    size = person.identity.proportions.teeth
    helper = person.vertices[person.group("helper-upper-teeth")]
    edge = np.array([0.0, helper[:, 1].min() - EDGE_BELOW_HELPER_M, helper[:, 2].max() - FRONT_BEHIND_HELPER_M])
    top = teeth("upperTeeth", UPPER, edge, head, size)
    bottom = teeth("lowerTeeth", LOWER, edge + size * np.array([0.0, OVERBITE_M, -OVERJET_M]), jaw, size)
    return join("mouth", [top, _follow(bottom, person, "helper-lower-teeth"), _tongue(person, jaw)])


def _follow(part: Part, person: Person, group: str) -> Part:
    """The part with the rigid motion that each shape gives to MakeHuman's helper in its place."""
    vertices = person.group(group)
    helper = person.vertices[vertices]
    units = person.units_of(vertices)
    motions = {name: kabsch(helper, helper + offsets) for name, offsets in units.items()}
    return replace(part, shapes={name: apply(T, part.positions) - part.positions for name, T in motions.items()})


def _tongue(person: Person, jaw: int) -> Part:
    vertices = person.group("helper-tongue")
    quads = np.searchsorted(vertices, person.mesh.quads[person.mesh.groups == "helper-tongue"])
    at = person.vertices[vertices]
    triangles = np.take_along_axis(quads[:, None, :], triangulate(quads, at), axis=2).reshape(-1, 3)
    return tongue(at, triangles, jaw, person.units_of(vertices))


def lashes_part(
    person: Person,
    skin: NDArray[np.float64],
    influences: tuple[NDArray[np.intp], NDArray[np.float64]],
) -> Part:
    """Lashes that follow the nearest vertex of the skin (V, 3) [m], whose joints and weights are `influences`."""
    rng = np.random.default_rng(LASH_SEED)
    tree = cKDTree(skin)
    near = np.asarray(tree.query(person.vertices)[0])
    joints, weights = influences
    parts = []
    for side in "lr":
        for strip, count, length in person.identity.lashes.strips:
            quads = person.mesh.quads[person.mesh.groups == f"helper-{side}-eyelashes-{strip}"]
            lift, triangles = hairs(strip_grid(quads, near), count, length, len(person.vertices), rng)
            at = lift @ person.vertices
            beside = tree.query(at)[1]
            uv = np.tile([0.5, 0.75 if strip == "1" else 0.25], (len(at), 1))
            shapes = {name: lift @ offsets for name, offsets in person.units.items()}
            normals = vertex_normals(at, triangles)
            parts.append(Part("lashes", at, normals, uv, triangles, joints[beside], weights[beside], shapes))
    return join("lashes", parts)
