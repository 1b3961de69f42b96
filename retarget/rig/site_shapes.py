"""How far each blend shape of a rig moves the skin under each site: what markers can see of a shape.

The motion of a site is that of the skin's vertex nearest to it and of that vertex's neighbours in the mesh, nearer ones
counting more; neighbours in the mesh and not in space, since shut lips lie on each other. Blend shapes are added in the
bind pose and carried by the joints at rest, as in `retarget.rig.skinning`. ``head``, metres, for a weight of 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from retarget.rig.model import Joints, Rig, Site, Surface

    Array = NDArray[np.float64]

SKIN_SHARE = 0.2
"""A surface is skin where it is the nearest one to this share of all sites: lashes, teeth and eyes are not."""


@dataclass(frozen=True, slots=True, eq=False)
class SiteShapes:
    """The blend shapes of a rig, seen at its sites."""

    sites: tuple[str, ...]
    shape_names: tuple[str, ...]
    displacements: Array
    """(S, 3, B) [m], ``head``: of each site by each shape at weight 1."""


def site_shapes(rig: Rig, sites: Sequence[str]) -> SiteShapes:
    """The shapes of `rig` at `sites`, names in `rig.sites`; InputError where the rig has none."""
    if not rig.surfaces:
        raise InputError(f"The rig {rig.name!r} has no surface for blend shapes to move: drive its joints.")
    if not rig.shape_names:
        raise InputError(f"The rig {rig.name!r} has no blend shapes: drive its joints, or choose a rig that has some.")
    skin = _skin(rig)
    moves = [_displacement(rig, skin, rig.sites[name]) for name in sites]
    return SiteShapes(tuple(sites), rig.shape_names, np.array(moves).reshape(len(moves), 3, len(rig.shape_names)))


def _skin(rig: Rig) -> list[Surface]:
    """The surfaces that sites lie on."""
    places = [_place(rig, site) for site in rig.sites.values()]
    nearest = [min(range(len(rig.surfaces)), key=lambda s: _nearest(rig.surfaces[s], p)[1]) for p in places]
    counts = np.bincount(nearest, minlength=len(rig.surfaces))
    return [s for s, count in zip(rig.surfaces, counts, strict=True) if count >= SKIN_SHARE * len(places)]


def _displacement(rig: Rig, skin: Iterable[Surface], site: Site) -> Array:
    """(3, B) [m]."""
    place = _place(rig, site)
    surface = min(skin, key=lambda s: _nearest(s, place)[1])
    vertices = _around(surface, place)
    apart = np.linalg.norm(surface.positions[vertices] - place, axis=1)
    weights = 1 / (apart + apart.mean() + 1e-9) ** 2
    R = _carried(rig.joints, surface, vertices)  # (V, 3, 3)
    moves = np.zeros((3, len(surface.shapes)))
    for b, shape in enumerate(surface.shapes):
        offsets = np.zeros((len(vertices), 3))
        _, here, there = np.intersect1d(vertices, shape.vertices, return_indices=True)
        offsets[here] = shape.offsets[there]
        moves[:, b] = weights / weights.sum() @ (R @ offsets[:, :, None])[:, :, 0]
    return moves


def _place(rig: Rig, site: Site) -> Array:
    """(3,) [m], ``rig``, at rest."""
    place: Array = rig.joints.T_rig_joint[site.joint, :3, 3]
    return place


def _nearest(surface: Surface, place: Array) -> tuple[int, float]:
    """The vertex nearest to `place`, and how far it is off [m]."""
    apart = np.linalg.norm(surface.positions - place, axis=1)
    vertex = int(np.argmin(apart))
    return vertex, float(apart[vertex])


def _around(surface: Surface, place: Array) -> NDArray[np.intp]:
    """The vertex nearest to `place` with all that share a triangle with it, or with one at the same point (a seam)."""
    nearest, _ = _nearest(surface, place)
    same = np.flatnonzero((surface.positions == surface.positions[nearest]).all(axis=1))
    touching = np.isin(surface.triangles, same).any(axis=1)
    return np.union1d(same, surface.triangles[touching])


def _carried(joints: Joints, surface: Surface, vertices: NDArray[np.intp]) -> Array:
    """(V, 3, 3): what the joints at rest make of an offset in the bind pose."""
    used = surface.joints[vertices]
    T = joints.T_rig_joint[used, :3, :3] @ np.nan_to_num(joints.T_joint_mesh[used, :3, :3])
    carried: Array = np.einsum("vi,vijk->vjk", surface.joint_weights[vertices].astype(float), T)
    return carried
