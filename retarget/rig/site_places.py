"""Where the sites are on somebody's mesh: the default rig's sites, carried over by what both faces share.

Landmarks are the middles of motion of the blend shapes that both have (where a smile pulls, where the chin drops), and
the joints of the eyes. The map between them is affine where there are landmarks enough, else a similarity (Umeyama
1991); then each site goes to the nearest vertex that any blend shape moves. ``rig``, metres.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.geometry import apply, umeyama

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from numpy.typing import NDArray

    from retarget.rig.model import Rig, Surface

    Array = NDArray[np.float64]

FEWEST, FEWEST_AFFINE = 4, 16
RIDGE = 0.02
"""Pull of the affine map to the similarity, as a share of the landmarks' spread."""
FARTHEST = 0.35
"""A joint drives the site that is nearest, but not from farther than this part of the distance between the eyes."""


def landmarks(rig: Rig) -> dict[str, Array]:
    """Name to place (3,): the middle of each shape's motion, and ``eye_left``, ``eye_right`` where there are joints."""
    found = {}
    for b, name in enumerate(rig.shape_names):
        parts = [(s.positions[s.shapes[b].vertices], s.shapes[b].offsets) for s in rig.surfaces]
        places = np.concatenate([p for p, _ in parts]).astype(float)
        weights = np.linalg.norm(np.concatenate([o for _, o in parts]).astype(float), axis=1)
        if weights.sum() > 0:
            found[name] = weights @ places / weights.sum()
    for role, joint in zip(("eye_left", "eye_right"), rig.eye_joints, strict=True):
        if joint is not None:
            found[role] = rig.joints.T_rig_joint[joint, :3, 3]
    return found


def carried_sites(model: Rig, theirs: Rig) -> dict[str, Array]:
    """Site of `model` to its place (3,) near the mesh of `theirs`; empty where they share too little."""
    here, there = landmarks(model), landmarks(theirs)
    shared = [name for name in here if name in there]
    source, goal = (np.array([marks[name] for name in shared]) for marks in (here, there))
    if len(shared) < FEWEST or np.linalg.norm(goal - goal.mean(0), axis=1).max() < 1e-6:
        return {}
    origin = model.joints.T_rig_joint[model.head_joint, :3, 3]
    places = np.array([site.rest for site in model.sites.values()]) + origin
    return dict(zip(model.sites, _mapped(source, goal, places), strict=True))


def _mapped(source: Array, goal: Array, places: Array) -> Array:
    T, scale = umeyama(source, goal)
    similar: Array = apply(T, scale * places)
    if len(source) < FEWEST_AFFINE:
        return similar
    before = apply(T, scale * source)
    centre = before.mean(0)
    spread = before - centre
    pull = RIDGE * np.trace(spread.T @ spread)
    left = goal - before
    A = np.linalg.solve(spread.T @ spread + pull * np.eye(3), spread.T @ (left - left.mean(0)))
    moved: Array = similar + left.mean(0) + (similar - centre) @ A
    return moved


def on_the_mesh(places: Mapping[str, Array], surfaces: Collection[Surface]) -> dict[str, Array]:
    """Each place moved to the nearest vertex that some shape moves, on the surface with the most of these."""
    moving = [np.unique(np.concatenate([np.zeros(0, np.intp), *(h.vertices for h in s.shapes)])) for s in surfaces]
    best = max(zip(moving, surfaces, strict=True), key=lambda pair: len(pair[0]))
    vertices = best[1].positions[best[0]].astype(float)
    return {name: vertices[np.argmin(np.linalg.norm(vertices - place, axis=1))] for name, place in places.items()}


def nearest_joints(rig: Rig, places: Mapping[str, Array], taken: Collection[int]) -> dict[str, int]:
    """Site to the joint below the head that stands nearest, each joint once; only joints that carry the mesh."""
    eyes = [rig.joints.T_rig_joint[j, :3, 3] for j in rig.eye_joints if j is not None]
    if len(eyes) < 2 or not places:
        return {}
    reach = FARTHEST * float(np.linalg.norm(eyes[0] - eyes[1]))
    below = _below_head(rig)
    free = [j for j in sorted(_carrying(rig) & below) if j not in taken]
    pairs = sorted(
        (float(np.linalg.norm(rig.joints.T_rig_joint[j, :3, 3] - place)), site, j)
        for site, place in places.items()
        for j in free
    )
    found: dict[str, int] = {}
    for apart, site, joint in pairs:
        if apart <= reach and site not in found and joint not in found.values():
            found[site] = joint
    return found


def _carrying(rig: Rig) -> set[int]:
    used: set[int] = set()
    for surface in rig.surfaces:
        used |= {int(j) for j in np.unique(surface.joints[surface.joint_weights > 0.05])}
    return used


def _below_head(rig: Rig) -> set[int]:
    found: set[int] = set()
    for j, parent in enumerate(rig.joints.parents):
        if parent == rig.head_joint or int(parent) in found:
            found.add(j)
    return found
