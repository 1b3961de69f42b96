"""The joint mapping: a frame of stabilised markers becomes a pose of the rig, J = J0 + K (M - M0).

M and M0 are the marker now and in the neutral, in the performer's ``head``; J and J0 the facial joint at its site, in
the rig's. The jaw turns instead, about its hinge, by the angle that `retarget.rig.jaw` reads at the chin. Joints that
ride on the jaw get only what is left of the displacement once the measured jaw turn is taken back, or the lip would
move twice; a turn beyond the jaw's limits is not taken back, so a jaw that is pushed forward, which reads as closing,
moves chin and lip by their joints. The head's own turn is shared out to neck and head. Metres and radians.
"""

from __future__ import annotations

import difflib
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from retarget.errors import InputError
from retarget.frames import Pose
from retarget.performer import gain_matrix
from retarget.rig import turns
from retarget.rig.jaw import jaw_reader

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame, MarkerLayout
    from retarget.performer import Performer, PerformerJaw
    from retarget.rig.jaw import JawReader
    from retarget.rig.model import Joints, Rig, Site

    Array = NDArray[np.float64]

NECK_SHARE = 0.4
"""Part of the head's turn that the neck takes; the head does the rest."""
JAW_SITES = (("chin", "chinLeft", "chinRight"), ("lipLower", "lipLowerLeft", "lipLowerRight"))
"""Where the jaw's turn is read: at the first group of which the layout has a marker with a neutral."""


class JointMapping:
    """Solves the frames of one layout for one performer on one rig; it holds no history."""

    def __init__(
        self, rig: Rig, layout: MarkerLayout, performer: Performer, T_world_reference: Array | None = None
    ) -> None:
        """`T_world_reference` is the head (4, 4) at which the rig's head stands straight; by default the world's axes.

        InputError where the performer was calibrated for another rig or has a K for a site that the rig lacks, and
        where no marker drives the rig.
        """
        _check(rig, performer)
        bindings = _bindings(rig, layout, performer)
        self.sites = tuple(dict.fromkeys(b.site.name for b in bindings))
        """The sites that are driven."""
        self._layout = layout
        self._sites = _SiteMotion(rig.joints, bindings, performer)
        self._jaw = _JawTurn.of(rig, layout, performer)
        self._head = _head_shares(rig)
        self._T_world_reference = np.eye(4) if T_world_reference is None else np.asarray(T_world_reference, float)
        self._rest = rig.joints.translations, rig.joints.rotations
        self._shapes = len(rig.shape_names)

    def jaw_angle(self, frame: MarkerFrame) -> float:
        """How far the performer's own jaw has turned from the neutral [rad]; NaN where it cannot be read."""
        return self._jaw.measured(frame.positions) if self._jaw else math.nan

    def __call__(self, frame: MarkerFrame) -> Pose:
        """The pose of a stabilised frame, never NaN: a joint whose markers are not seen, the jaw too, is at rest."""
        if frame.T_world_head is None or len(frame.positions) != len(self._layout.names):
            raise ValueError("The joint mapping takes stabilised frames of its own layout.")
        translations, rotations = (a.copy() for a in self._rest)
        angle = self._jaw.possible(frame.positions) if self._jaw else math.nan
        self._sites.add_to(translations, frame.positions, 0.0 if math.isnan(angle) else angle)
        if self._jaw and not math.isnan(angle):
            rotations[self._jaw.joint.joint] = self._jaw.local(angle)
        T_world_head = frame.T_world_head if math.isfinite(frame.T_world_head.sum()) else self._T_world_reference
        turn = turns.from_matrix(self._T_world_reference[:3, :3].T @ T_world_head[:3, :3])
        for joint, share in self._head:
            rotations[joint.joint] = joint.local(turns.part(turn, share))
        return Pose(
            number=frame.number,
            time_s=frame.time_s,
            received_s=frame.received_s,
            T_world_head=T_world_head,
            translations=translations,
            rotations=rotations,
            weights=np.zeros(self._shapes),
        )


class _Binding(NamedTuple):
    """A marker that drives a joint."""

    marker: int
    neutral: Array
    """(3,) [m], the performer's ``head``."""
    site: Site


class _SiteMotion:
    """Moves the facial joints: K (M - M0) for each marker, the mean of those seen for each joint."""

    def __init__(self, joints: Joints, bindings: list[_Binding], performer: Performer) -> None:
        driven = list(dict.fromkeys(b.site.joint for b in bindings))
        self._joints = np.array(driven, np.intp)
        self._markers = np.array([b.marker for b in bindings], np.intp)
        self._neutral = np.array([b.neutral for b in bindings])
        self._riders = slice(0, sum(b.site.rides_jaw for b in bindings))
        self._hinge = _Hinge.of(performer.jaw) if performer.jaw else None
        scale = gain_matrix(performer.scale)
        gains = [performer.K.get(b.site.name, scale) for b in bindings]
        apart = any(K.ndim == 3 for K in gains)
        self._K = np.array([K[0] if K.ndim == 3 else K for K in gains])
        self._K_back = np.array([K[1] if K.ndim == 3 else K for K in gains]) if apart else None
        self._R_parent_rig = np.array([turns.parent_rest(joints, j).T for j in driven])
        self._mean = _mean_over_markers(driven, bindings)
        self._carriers = _carriers(joints, driven)

    def add_to(self, translations: Array, positions: Array, jaw_angle: float) -> None:
        """Add to the joints' rest `translations` (J, 3) what the markers (M, 3) in ``head`` have moved."""
        p = positions[self._markers]
        if jaw_angle and self._hinge:
            p[self._riders] = self._hinge.turned_back(p[self._riders], jaw_angle)
        moved = p - self._neutral  # (N, 3)
        seen = np.isfinite(moved.sum(axis=1))
        moved[~seen] = 0.0
        moves = self._scaled(moved)
        if self._mean is not None:
            moves = self._mean @ moves / np.maximum(self._mean @ seen, 1.0)[:, None]
        if self._carriers is not None:
            moves = moves - np.vstack([moves, np.zeros(3)])[self._carriers]
        translations[self._joints] += (self._R_parent_rig @ moves[:, :, None])[:, :, 0]

    def _scaled(self, moved: Array) -> Array:
        """K times the displacements (N, 3); what they have on the negative side of an axis may have a K of its own."""
        if self._K_back is None:
            return (self._K @ moved[:, :, None])[:, :, 0]
        ahead = np.maximum(moved, 0.0)
        return (self._K @ ahead[:, :, None] + self._K_back @ (moved - ahead)[:, :, None])[:, :, 0]


class _Hinge(NamedTuple):
    """Rodrigues' formula about a fixed axis, R(angle) = along + across cos + cross sin, all (3, 3)."""

    pivot: Array
    along: Array
    across: Array
    cross: Array

    @classmethod
    def of(cls, jaw: PerformerJaw) -> _Hinge:
        x, y, z = jaw.axis
        along = np.outer(jaw.axis, jaw.axis)
        return cls(jaw.pivot, along, np.eye(3) - along, np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]))

    def turned_back(self, points: Array, angle: float) -> Array:
        """`points` (N, 3) before the turn by `angle`: rows times R(angle) are columns times R(-angle)."""
        R = self.along + self.across * math.cos(angle) + self.cross * math.sin(angle)
        return (points - self.pivot) @ R + self.pivot


class _JawTurn(NamedTuple):
    """Turns the rig's jaw by what the performer's does."""

    joint: turns.Turner
    axis: tuple[float, float, float]
    gain: float
    min_rad: float
    max_rad: float
    markers: NDArray[np.intp]
    reader: JawReader

    @classmethod
    def of(cls, rig: Rig, layout: MarkerLayout, performer: Performer) -> _JawTurn | None:
        """None where the rig or the performer has no jaw, or no marker is at the chin or the lower lip."""
        if rig.jaw is None or performer.jaw is None:
            return None
        known = _known_neutrals(layout, performer)
        groups = ([i for i in known if layout.sites[i] in group] for group in JAW_SITES)
        markers = next((group for group in groups if group), None)
        if markers is None:
            return None
        x, y, z = rig.jaw.axis.tolist()
        return cls(
            joint=turns.turner(rig.joints, rig.jaw.joint),
            axis=(x, y, z),
            gain=performer.jaw.gain,
            min_rad=max(rig.jaw.min_rad, performer.jaw.min_rad),
            max_rad=min(rig.jaw.max_rad, performer.jaw.max_rad),
            markers=np.array(markers, np.intp),
            reader=jaw_reader(performer.jaw, np.array([known[i] for i in markers])),
        )

    def measured(self, positions: Array) -> float:
        """The performer's turn [rad]."""
        return self.reader(positions[self.markers])

    def possible(self, positions: Array) -> float:
        """The part of the performer's turn that the rig's jaw can follow [rad]."""
        angle = self.measured(positions)
        if math.isnan(angle) or self.min_rad <= self.gain * angle <= self.max_rad or self.gain == 0.0:
            return angle
        return min(max(self.gain * angle, self.min_rad), self.max_rad) / self.gain

    def local(self, angle: float) -> turns.Quat:
        """The jaw joint's rotation for the performer's turn `angle`."""
        return self.joint.local(turns.about(self.axis, min(max(self.gain * angle, self.min_rad), self.max_rad)))


def _check(rig: Rig, performer: Performer) -> None:
    if performer.rig != rig.name:
        raise InputError(
            f"The performer {performer.name!r} was calibrated for the rig {performer.rig!r}, not for {rig.name!r}: "
            "calibrate for this rig, or run with the other."
        )
    for site in performer.K:
        if site not in rig.sites:
            near = difflib.get_close_matches(site, rig.sites, n=1)
            advice = f"did you mean {near[0]!r}?" if near else f"it has {', '.join(rig.sites)}."
            raise InputError(f"The performer {performer.name!r} has a K for {site!r}, no site of this rig; {advice}")


def _bindings(rig: Rig, layout: MarkerLayout, performer: Performer) -> list[_Binding]:
    """The markers that drive a joint, those that ride on the jaw first."""
    turned = {rig.head_joint, rig.neck_joint, rig.jaw.joint if rig.jaw else None}
    bindings = [
        _Binding(i, neutral, rig.sites[layout.sites[i]])
        for i, neutral in _known_neutrals(layout, performer).items()
        if layout.sites[i] in rig.sites and rig.sites[layout.sites[i]].joint not in turned
    ]
    if not bindings:
        raise InputError(
            f"No marker of the layout {layout.name!r} drives the rig {rig.name!r} with the performer "
            f"{performer.name!r}: the markers are {', '.join(layout.names)}; the performer's neutral has "
            f"{', '.join(performer.markers)}; the rig's sites are {', '.join(rig.sites)}."
        )
    return sorted(bindings, key=lambda b: not b.site.rides_jaw)


def _known_neutrals(layout: MarkerLayout, performer: Performer) -> dict[int, Array]:
    """The neutral (3,) by the index in the layout, of the markers that have both a site and a neutral."""
    neutrals = dict(zip(performer.markers, performer.neutral, strict=True))
    named = zip(layout.names, layout.sites, strict=False)  # a layout that knows nothing of the rig has no sites
    return {
        i: neutrals[n] for i, (n, site) in enumerate(named) if site and n in neutrals and np.isfinite(neutrals[n]).all()
    }


def _mean_over_markers(driven: list[int], bindings: list[_Binding]) -> Array | None:
    """(D, N) of 0 and 1, which marker belongs to which joint; None where every joint has its own."""
    if len(driven) == len(bindings):
        return None
    return np.array([[float(b.site.joint == joint) for b in bindings] for joint in driven])


def _carriers(joints: Joints, driven: list[int]) -> NDArray[np.intp] | None:
    """(D,) index of the nearest driven joint above each, D where there is none; None where no joint carries another."""
    carriers = []
    for joint in driven:
        above = int(joints.parents[joint])
        while above >= 0 and above not in driven:
            above = int(joints.parents[above])
        carriers.append(driven.index(above) if above >= 0 else len(driven))
    return np.array(carriers, np.intp) if min(carriers) < len(driven) else None


def _head_shares(rig: Rig) -> list[tuple[turns.Turner, float]]:
    """Neck and head with their parts of the head's turn; the head takes all where the rig has no neck."""
    head = turns.turner(rig.joints, rig.head_joint)
    if rig.neck_joint is None:
        return [(head, 1.0)]
    return [(turns.turner(rig.joints, rig.neck_joint), NECK_SHARE), (head, 1.0 - NECK_SHARE)]
