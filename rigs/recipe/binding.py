"""Bind the skin to the joints: one joint a site, and the skull, the jaw and the neck for the rest.

Sites blend among each other by bounded biharmonic weights. Far from every site the skin keeps MakeHuman's own weights
for head, jaw and neck. Nothing crosses the mouth or the lids: the joints of the lower lip have bound 0 on the upper
one, and the other way round.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe.sites import rides_jaw
from rigs.recipe.skeleton import HEAD, JAW, NECK
from rigs.recipe.weights import bounded_biharmonic, strongest, surface_distance

if TYPE_CHECKING:
    from numpy.typing import NDArray

INFLUENCES = 4
REACH_M = 0.030
"""Skin farther than this from every site, along the surface, keeps MakeHuman's weights."""
LIP_M = 0.009
"""How far from the line between the lips the inside of the mouth follows them."""
LID_M = 0.014
"""How far behind its edge the inside of a lid follows it."""
LID_TRAVEL_M = 0.0075
"""The upper lid follows its joint where a blink moves it this far, and the less the less a blink moves it."""
FLESH_M = 0.016
"""A lip or a lid reaches this far from its joints."""
CORNER_M = 0.002
"""The lips grow together over this width at the corners of the mouth."""
JAW_BONES = ("jaw", "special04", "oris01", "oris06.", "oris07.", "tongue")
NECK_BONES = ("neck", "spine", "clavicle", "shoulder", "breast", "upperarm")


@dataclass(frozen=True, slots=True, eq=False)
class Bones:
    """MakeHuman's weights, gathered to three joints; (V,) each, they add up to 1."""

    head: NDArray[np.float64]
    jaw: NDArray[np.float64]
    neck: NDArray[np.float64]


def gather(bone_weights: dict[str, NDArray[np.float64]]) -> Bones:
    """The weights of all bones as those of head, jaw and neck."""
    total = sum(bone_weights.values(), np.zeros(1))
    jaw = sum((row for bone, row in bone_weights.items() if bone.startswith(JAW_BONES)), np.zeros(1)) / total
    neck = sum((row for bone, row in bone_weights.items() if bone.startswith(NECK_BONES)), np.zeros(1)) / total
    return Bones(1 - jaw - neck, jaw, neck)


def stand(bones: Bones, foot: NDArray[np.float64]) -> Bones:
    """The weights with the neck's share raised to at least `foot` (V,), so that the rim stays a clean loop."""
    neck = np.maximum(bones.neck, foot)
    rest = (1 - neck) / np.maximum(1 - bones.neck, 1e-9)
    return Bones(bones.head * rest, bones.jaw * rest, neck)


@dataclass(frozen=True, slots=True, eq=False)
class Regions:
    """Parts of the skin that the binding treats apart; (V,) masks."""

    mouth: NDArray[np.bool_]
    """The inside of the mouth, lips excluded."""
    sockets: NDArray[np.bool_]
    """Behind the lids."""
    lids: dict[str, NDArray[np.float64]]
    """For the joint of each upper lid, how far [m] a blink moves the skin, (V,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Binding:
    """Skin weights (V, J) dense, and the name of each joint."""

    names: tuple[str, ...]
    weights: NDArray[np.float64]

    def influences(self) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """The strongest `INFLUENCES` joints of each vertex and their weights."""
        return strongest(self.weights, INFLUENCES)


def bind_skin(
    positions: NDArray[np.float64],
    triangles: NDArray[np.intp],
    sites: dict[str, int],
    bones: Bones,
    regions: Regions,
) -> Binding:
    """Weights of every site joint, head, jaw and neck for the skin (V, 3) [m]."""
    names = (*sites, HEAD, JAW)
    given = _given(positions, triangles, sites, bones, regions)
    bound = _bounds(positions, triangles, sites)
    weights = bounded_biharmonic(positions, triangles, given, bound)
    skull = weights[:, names.index(HEAD)].copy()
    neck = bones.neck / np.maximum(bones.neck + bones.head, 1e-9)
    weights[:, names.index(HEAD)] = skull * (1 - neck)
    return Binding((*names, NECK), np.column_stack([weights, skull * neck]))


def _given(
    positions: NDArray[np.float64],
    triangles: NDArray[np.intp],
    sites: dict[str, int],
    bones: Bones,
    regions: Regions,
) -> NDArray[np.float64]:
    """(V, S + 2): one joint at each site, MakeHuman's weights far from all of them, NaN between."""
    vertices = np.array(list(sites.values()))
    given = np.full((len(positions), len(sites) + 2), np.nan)
    far = surface_distance(positions, triangles, vertices) > REACH_M
    for inside, depth in ((regions.mouth, LIP_M), (regions.sockets, LID_M)):
        far |= inside & (surface_distance(positions, triangles, np.flatnonzero(~inside)) > depth)
    jaw = np.where(regions.mouth, _jaw_share(positions, triangles, sites), bones.jaw)
    given[far] = 0
    given[far, -1] = jaw[far]
    given[far, -2] = 1 - jaw[far]
    for joint, travel in regions.lids.items():
        lid = travel > LID_TRAVEL_M / 2
        follow = np.minimum(travel[lid] / LID_TRAVEL_M, 1)
        given[lid] = 0
        given[lid, list(sites).index(joint)] = follow
        given[lid, -2] = 1 - follow
    given[vertices] = np.eye(len(sites), len(sites) + 2)
    return given


def _jaw_share(
    positions: NDArray[np.float64], triangles: NDArray[np.intp], sites: dict[str, int]
) -> NDArray[np.float64]:
    """(V,) for the inside of the mouth: the floor follows the jaw, the palate the skull, the cheeks lie between."""
    to_upper = surface_distance(positions, triangles, _named(sites, "lipUpper"))
    to_lower = surface_distance(positions, triangles, _named(sites, "lipLower"))
    share = np.clip((to_upper / (to_upper + to_lower) - 0.5) * 5 + 0.5, 0, 1)
    return np.asarray(share * share * (3 - 2 * share))


def _bounds(positions: NDArray[np.float64], triangles: NDArray[np.intp], sites: dict[str, int]) -> NDArray[np.float64]:
    """(V, S + 2): 0 where a joint must not reach, 1 elsewhere."""
    names = (*sites, HEAD, JAW)
    bound = np.ones((len(positions), len(names)))
    from_lower = np.array([rides_jaw(name) or name == JAW for name in names])
    from_upper = np.array([name.startswith(("lipUpper", "nose", "cheekUpper")) or name == HEAD for name in names])
    width = abs(positions[sites["lipCornerLeft"], 0]) - CORNER_M
    between = np.abs(positions[:, 0]) < width
    upper, lower = _sides(positions, triangles, _named(sites, "lipUpper"), _named(sites, "lipLower"))
    bound[np.ix_(upper & between, from_lower)] = 0
    bound[np.ix_(lower & between, from_upper)] = 0
    for side in ("Left", "Right"):
        upper, lower = _sides(positions, triangles, _named(sites, f"lidUpper{side}"), _named(sites, f"lidLower{side}"))
        bound[upper, names.index(f"lidLower{side}")] = 0
        bound[lower, names.index(f"lidUpper{side}")] = 0
    return bound


def _named(sites: dict[str, int], beginning: str) -> NDArray[np.intp]:
    return np.array([vertex for name, vertex in sites.items() if name.startswith(beginning)])


def _sides(
    positions: NDArray[np.float64],
    triangles: NDArray[np.intp],
    upper: NDArray[np.intp],
    lower: NDArray[np.intp],
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Vertices around `upper` that are nearer to it than to `lower` along the surface, and the converse."""
    to_upper = surface_distance(positions, triangles, upper)
    to_lower = surface_distance(positions, triangles, lower)
    return (to_upper < to_lower) & (to_upper < FLESH_M), (to_lower < to_upper) & (to_lower < FLESH_M)
