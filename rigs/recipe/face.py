"""The skin of the head: cut, rounded, bound to the joints, and with its shapes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe.atlas import inner, islands, pack
from rigs.recipe.binding import Binding, Regions, bind_skin, gather, stand
from rigs.recipe.complexion import hair_cover
from rigs.recipe.paint import look_up, smoothstep
from rigs.recipe.part import Part, vertex_normals
from rigs.recipe.refine import refine, thicken
from rigs.recipe.shapes import iron, looseness
from rigs.recipe.sites import LEFT, MIDDLE, other_side
from rigs.recipe.skin import close, cut_head
from rigs.recipe.weights import surface_distance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.person import Person
    from rigs.recipe.skeleton import Skeleton
    from rigs.recipe.skin import Skin
    from rigs.recipe.source import Wheel

CUT_ABOVE_NECK_M = 0.010
CUT_TILT_DEG = 18.0
SPLITS, LONGEST_EDGE_M = 2, 0.014
HAIR_M = 0.0035
FOOT_M = (0.004, 0.035)
"""The skin belongs to the neck alone up to the first distance from the cut, and as MakeHuman says from the second."""
LIPS_UP_M = {"lipLower": 0.0009, "lipUpper": -0.0002}
"""How far the lips move to shut the mouth."""
LIPS_LOOSE = 0.35
"""The shapes are ironed this much on the lips, fully on the cheeks."""
FINE = ("lip", "lid", "eye", "nose", "brow")
"""The shapes keep their detail around sites whose names begin so."""


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """The bound skin."""

    skin: Skin
    sites: dict[str, int]
    """The vertex of every site."""
    binding: Binding


def head_of(person: Person) -> Skin:
    """The head cut out of the body, closed at the neck, with some thickness of hair."""
    body = person.mesh.groups == "body"
    tilt = np.radians(CUT_TILT_DEG)
    normal = np.array([0.0, np.cos(tilt), np.sin(tilt)])
    neck = person.vertices[person.group("joint-neck")].mean(0)
    plane = neck + np.array([0.0, CUT_ABOVE_NECK_M, 0.0]), normal
    skin = cut_head(person.vertices, person.mesh.quads[body], person.mesh.uv[person.mesh.quad_uv[body]], plane)
    for _ in range(SPLITS):
        skin = refine(skin, person.vertices, LONGEST_EDGE_M)
    skin = close(skin, person.vertices, normal)
    source_uv = np.zeros((skin.lift.shape[0], 2))
    source_uv[skin.triangles] = skin.uv
    return thicken(skin, person.vertices, HAIR_M * hair_cover(person.on_canvas(skin), source_uv))


def bind(skin: Skin, person: Person, wheel: Wheel) -> Face:
    """Find the sites, weigh the skin, and shut the mouth."""
    count = len(person.vertices)
    sites = _site_vertices(skin, wheel.mirror(count))
    positions = skin.positions(person.vertices)
    to_rim = surface_distance(positions, skin.triangles, skin.rim)
    to_rim[_below(positions, skin)] = 0
    bones = gather({bone: skin.lift @ row for bone, row in wheel.bone_weights(count).items()})
    bones = stand(bones, smoothstep(FOOT_M[1], FOOT_M[0], to_rim))
    binding = bind_skin(positions, skin.triangles, sites, bones, _regions(skin, person))
    return Face(_shut(skin, binding), sites, binding)


def _below(positions: NDArray[np.float64], skin: Skin) -> NDArray[np.bool_]:
    """(V,) the vertices of the base, which lie below the plane of the rim."""
    rim = positions[skin.rim]
    normal = np.linalg.svd(rim - rim.mean(0))[2][2]
    return np.asarray((positions - rim.mean(0)) @ (normal * np.sign(normal[1])) < 0)


def _site_vertices(skin: Skin, mirror: NDArray[np.intp]) -> dict[str, int]:
    lift = skin.lift.tocoo()
    whole = lift.data == 1.0
    where = dict(zip(lift.col[whole][::-1].tolist(), lift.row[whole][::-1].tolist(), strict=True))
    right = {other_side(name): int(mirror[vertex]) for name, vertex in LEFT.items()}
    return {name: where[vertex] for name, vertex in (MIDDLE | LEFT | right).items()}


def _regions(skin: Skin, person: Person) -> Regions:
    within = {}
    for name, island in islands(skin.uv).items():
        only = np.zeros(skin.lift.shape[0], dtype=bool)
        only[skin.triangles[island]] = True
        only[skin.triangles[~island]] = False
        within[name] = only
    blinks = {side: skin_offsets(skin, person, f"eyeBlink{side}") for side in ("Left", "Right")}
    lids = {f"lidUpper{side}": np.linalg.norm(offsets, axis=1) for side, offsets in blinks.items()}
    return Regions(within["mouth"], within["socketLeft"] | within["socketRight"], lids)


def skin_offsets(skin: Skin, person: Person, unit: str) -> NDArray[np.float64]:
    """Offsets (V, 3) [m] of a face unit; eye units also stir palate and other eye, which is undone."""
    offsets = np.asarray(skin.lift @ person.units[unit])
    if unit.startswith("eye"):
        found = islands(skin.uv)
        offsets[skin.triangles[found["mouth"] | found["socketRight" if unit.endswith("Left") else "socketLeft"]]] = 0
    return offsets


def _shut(skin: Skin, binding: Binding) -> Skin:
    """Move the lips together, as far as they follow their joints."""
    up = np.zeros(skin.lift.shape[0])
    for name, weights in zip(binding.names, binding.weights.T, strict=True):
        up += weights * next((height for lip, height in LIPS_UP_M.items() if name.startswith(lip)), 0.0)
    return replace(skin, offset=skin.offset + up[:, None] * [0.0, 1.0, 0.0])


def skin_part(face: Face, person: Person, skeleton: Skeleton, lip_mask: NDArray[np.float64]) -> Part:
    """The skin with one vertex for every pair of place and texture coordinate."""
    skin = face.skin
    positions = skin.positions(person.vertices)
    normals = vertex_normals(positions, skin.triangles)
    corners = np.column_stack([skin.triangles.reshape(-1, 1), np.round(pack(skin.uv).reshape(-1, 2), 6)])
    unique, index = np.unique(corners, axis=0, return_inverse=True)
    vertex = unique[:, 0].astype(int)
    joints, weights = rig_influences(face.binding, skeleton)
    loose = _loose(face, positions, lip_mask)
    shapes = {unit: iron(skin_offsets(skin, person, unit), skin.triangles, loose)[vertex] for unit in person.units}
    triangles = index.reshape(-1, 3)
    uv = unique[:, 1:]
    return Part("skin", positions[vertex], normals[vertex], uv, triangles, joints[vertex], weights[vertex], shapes)


def rig_influences(binding: Binding, skeleton: Skeleton) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """The strongest joints (V, 4), as numbers of the rig's joints, and their weights."""
    joints, weights = binding.influences()
    number = np.array([skeleton.index(name) for name in binding.names])
    return np.where(weights > 0, number[joints], 0), weights


def _loose(face: Face, positions: NDArray[np.float64], lip_mask: NDArray[np.float64]) -> NDArray[np.float64]:
    """(V,) in [0, 1], how much the shapes are ironed: fully on the cheeks, less on the lips, not at eyes and nose."""
    skin = face.skin
    red = np.zeros(len(positions), dtype=bool)
    red[skin.triangles] = look_up(lip_mask, skin.uv.reshape(-1, 2)).reshape(-1, 3) > 0.5
    within = skin.triangles[inner(skin.uv)].ravel()
    fine = [vertex for name, vertex in face.sites.items() if name.startswith(FINE)]
    firm = np.unique(np.concatenate([np.flatnonzero(red), within, fine]))
    return np.maximum(looseness(positions, skin.triangles, firm), LIPS_LOOSE * red)
