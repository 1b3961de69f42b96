"""How far the rig goes at every site: its own extremes, out of its blend shapes and the limits of its jaw.

A shape moves the skin; what it moves at a site is read at the skin nearest to the site's rest. As on the performer, the
jaw's turn is read at the chin and taken back from the sites that ride on it, so that both sides of the calibration mean
the same. Metres, radians, the rig's ``head``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.expressions import EXPRESSIONS
from retarget import geometry
from retarget.rig.jaw import signed_angle
from retarget.rig.joints import JAW_SITES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from retarget.rig.model import Rig

    Array = NDArray[np.float64]

NEAREST = 3
"""Skin vertices that tell the motion at a site, the nearer the more."""
REACH_M = 0.02
"""Skin farther from the site's rest than this is not the site's [m]."""
OPEN_SHAPE = "jawOpen"
CLOSED_RAD = np.radians(3.0)
"""A chin that reads less than this is moved by muscles over a closed jaw."""


@dataclass(frozen=True, slots=True, eq=False)
class RigExtreme:
    """The rig at the end of an expression."""

    name: str
    moves: Array
    """(S, 3) [m] of each site, without the jaw's turn at those that ride on it."""
    jaw_rad: float


class RigRange:
    """The extremes of one rig at some of its sites."""

    def __init__(self, rig: Rig, sites: Sequence[str]) -> None:
        self.rig = rig
        self.sites = tuple(sites)
        self.rest = np.array([rig.sites[site].rest for site in sites])
        self.rides = np.array([rig.sites[site].rides_jaw for site in sites], bool)
        self._fields = _shape_fields(rig, self.rest)
        self._chin = _Chin.of(rig)
        self._open_by_hinge()
        self.jaw_rad = self._jaw_range()
        """What the rig's jaw can open [rad]: to the end of its shape, where it has one, within the limits."""

    def extreme(self, name: str, weights: Mapping[str, float]) -> RigExtreme | None:
        """The rig with its shapes at `weights`; None where it has none of them, or they move no site."""
        weights = {shape: w for shape, w in weights.items() if shape in self.rig.shape_names}
        fields = (w * self._fields[self.rig.shape_names.index(shape)] for shape, w in weights.items())
        whole = sum(fields, np.zeros_like(self.rest))
        if np.abs(whole).max(initial=0.0) < 1e-4:
            return None
        angle = self._turn(weights)
        moves = whole.copy()
        if self.rig.jaw and angle:
            R = geometry.matrix_from_quat(geometry.quat_from_axis_angle(self.rig.jaw.axis, angle))
            back = (self.rest + whole - self.rig.jaw.pivot) @ R + self.rig.jaw.pivot - self.rest
            moves[self.rides] = back[self.rides]
        return RigExtreme(name, moves, angle)

    def extremes(self) -> list[RigExtreme]:
        """Those of the expressions that the rig can show."""
        found = [self.extreme(e.name, dict.fromkeys(e.shapes, 1.0)) for e in EXPRESSIONS]
        return [extreme for extreme in found if extreme]

    def _open_by_hinge(self) -> None:
        """At the chin, let the shape that opens the mouth be the turn of the jaw's joint, which does it here.

        An artist's shape bends the chin's path elsewhere than the joint does; the turn is what the chin shows.
        """
        if self.rig.jaw is None or OPEN_SHAPE not in self.rig.shape_names:
            return
        shape = self.rig.shape_names.index(OPEN_SHAPE)
        angle = self._turn({OPEN_SHAPE: 1.0})
        R = geometry.matrix_from_quat(geometry.quat_from_axis_angle(self.rig.jaw.axis, angle))
        chin = [i for i, site in enumerate(self.sites) if site in self._chin.sites]
        levers = self.rest[chin] - self.rig.jaw.pivot
        if angle:
            self._fields[shape, chin] = levers @ R.T - levers

    def _turn(self, weights: Mapping[str, float]) -> float:
        """The jaw's turn that the chin shows, within the rig's limits; 0 where nothing tells it, or it is closed."""
        if self.rig.jaw is None or not self._chin.sites:
            return 0.0
        moved = sum((w * self._chin.fields[self.rig.shape_names.index(s)] for s, w in weights.items()), np.zeros(3))
        levers = self._chin.rest - self.rig.jaw.pivot
        turn = float(np.nan_to_num(signed_angle(levers, levers + moved, self.rig.jaw.axis)))
        return min(turn, self.rig.jaw.max_rad) if turn > CLOSED_RAD else 0.0

    def _jaw_range(self) -> float:
        if self.rig.jaw is None:
            return 0.0
        shape = self.extreme(OPEN_SHAPE, {OPEN_SHAPE: 1.0})
        return shape.jaw_rad if shape and shape.jaw_rad > 0 else self.rig.jaw.max_rad


@dataclass(frozen=True, slots=True, eq=False)
class _Chin:
    """Where the rig's own turn is read, whatever the performer wears."""

    sites: tuple[str, ...]
    rest: Array
    """(C, 3) [m]"""
    fields: Array
    """(B, C, 3) [m]"""

    @classmethod
    def of(cls, rig: Rig) -> _Chin:
        names = tuple(rig.sites)
        sites = tuple(names[i] for i in chin_group(names))
        rest = np.array([rig.sites[site].rest for site in sites]).reshape(-1, 3)
        return cls(sites, rest, _shape_fields(rig, rest))


def chin_group(sites: Sequence[str]) -> list[int]:
    """Where the jaw's turn is read, as `retarget.rig.joints` does: the first group of sites that is there."""
    groups = ([i for i, site in enumerate(sites) if site in group] for group in JAW_SITES)
    return next((group for group in groups if group), [])


def _shape_fields(rig: Rig, rest: Array) -> Array:
    """(B, S, 3) [m]: what each shape at full weight moves at each place of `rest` (S, 3), ``head``."""
    fields = np.zeros((len(rig.shape_names), *rest.shape))
    if not rig.surfaces or not len(rest):
        return fields
    from scipy.spatial import cKDTree

    skin = max(rig.surfaces, key=lambda surface: len(surface.positions))
    origin = rig.joints.T_rig_joint[rig.head_joint, :3, 3]
    distances, vertices = cKDTree(skin.positions).query(
        rest + origin, k=range(1, min(NEAREST, len(skin.positions)) + 1)
    )
    near = np.where(distances < REACH_M, 1.0 / (distances + 1e-4) ** 2, 0.0)
    near /= np.maximum(near.sum(axis=1, keepdims=True), 1e-12)
    for b, shape in enumerate(skin.shapes):
        offsets = np.zeros(skin.positions.shape)
        offsets[shape.vertices] = shape.offsets
        fields[b] = np.einsum("sk,skx->sx", near, offsets[vertices])
    return fields
