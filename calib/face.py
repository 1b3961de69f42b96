"""A range of motion as displacements of the rig's sites: head motion, jaw and neutral taken out.

`FaceSites` says which markers of the layout drive which sites of the rig; the mapping that runs later makes the same
choice. Metres, ``head``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.rig_range import chin_group
from retarget import geometry
from retarget.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerLayout
    from retarget.rig.model import Rig

    Array = NDArray[np.float64]

FEWEST_SITES = 4


@dataclass(frozen=True, slots=True, eq=False)
class FaceSites:
    """The sites that a layout drives on a rig."""

    names: tuple[str, ...]
    """(S,)"""
    markers: NDArray[np.intp]
    """(S,) indices into the layout."""
    rides: NDArray[np.bool_]
    """(S,) True where the jaw carries the site."""
    chin: list[int]
    """The sites at which the jaw's turn is read."""


def face_sites(layout: MarkerLayout, neutral: Array, rig: Rig) -> FaceSites:
    """The sites of markers whose `neutral` (M, 3) is known; InputError where layout and rig share too few."""
    turned = {rig.head_joint, rig.neck_joint, rig.jaw.joint if rig.jaw else None}
    known = np.isfinite(neutral.sum(axis=1))
    markers = [
        i
        for i, site in enumerate(layout.sites)
        if known[i] and site in rig.sites and rig.sites[site].joint not in turned
    ]
    if len(markers) < FEWEST_SITES:
        raise InputError(
            f"The layout {layout.name!r} and the rig {rig.name!r} share {len(markers)} sites that were seen at rest; "
            f"{FEWEST_SITES} are needed. The layout drives {', '.join(s for s in layout.sites if s) or 'none'}; "
            f"the rig has {', '.join(rig.sites) or 'none'}."
        )
    names = tuple(layout.sites[i] for i in markers)
    rides = np.array([rig.sites[name].rides_jaw for name in names], bool)
    return FaceSites(names, np.array(markers, np.intp), rides, chin_group(names))


def site_moves(
    face: FaceSites, neutral: Array, positions: Array, turn_rad: Array | None, axis: Array, pivot: Array
) -> Array:
    """(T, S, 3) [m] from `neutral` (M, 3), of `positions` (T, M, 3), the jaw's turn (T,) taken back where it carries.

    A frame whose turn is NaN keeps it in; None where there is no jaw.
    """
    moves: Array = positions[:, face.markers] - neutral[face.markers]
    if turn_rad is not None and face.rides.any():
        R = geometry.matrix_from_quat(geometry.quat_from_axis_angle(axis, np.nan_to_num(turn_rad)))
        riders = face.markers[face.rides]
        moves[:, face.rides] = (positions[:, riders] - pivot) @ R + pivot - neutral[riders]
    return moves
