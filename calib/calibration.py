"""From takes to a performer: the whole way in one place, and everything that a report tells of it.

neutral -> head -> hinge of the jaw -> displacements -> expressions found -> axes of the head -> K -> score.
Metres, seconds, radians; ``head`` as in `retarget.performer`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from calib.axes import refine_axes
from calib.face import face_sites, site_moves
from calib.fixed import with_fixed
from calib.gains import STRENGTH, Gains, site_graph, solve_gains
from calib.jaw import fit_jaw
from calib.make_performer import HeadTurn, make_performer
from calib.matching import Motion, find_matches, moves_in
from calib.material import RangeTake, lay_out
from calib.pairs import concerned, make_pairs, pairs_of_matches
from calib.protrusion import jaw_motion
from calib.reference_poses import choose_strength, held_frames, rig_pose
from calib.rig_range import RigRange
from calib.rolling import rolling_mean
from calib.score import HeldOut, deal, held_out
from retarget.errors import InputError
from retarget.rig.fit import performer_from_neutral

if TYPE_CHECKING:
    import datetime
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from calib.face import FaceSites
    from calib.jaw import JawFit
    from calib.matching import Match
    from calib.material import LaidOut, Material
    from calib.pairs import Pairs
    from calib.rig_range import RigExtreme
    from retarget.frames import MarkerLayout
    from retarget.performer import Performer
    from retarget.rig.model import Rig

    Array = NDArray[np.float64]

BOUNDS = (0.25, 1.0)
"""K goes from the first to the second times the ratio of sizes; the jaw's gain between them as they are."""
RANGE_SHARE = 0.995
RANGE_S = 0.1
STEPS = ("head motion", "jaw", "expressions", "K", "score")


@dataclass(frozen=True, slots=True, eq=False)
class Settings:
    """What the user may choose."""

    name: str = "performer"
    bounds: tuple[float, float] = BOUNDS
    previous: Performer | None = None
    """The file's former content, whose fixed values are kept."""
    date: datetime.date | None = None
    """Today where not given."""

    def __post_init__(self) -> None:
        low, high = self.bounds
        if not 0 < low < high:
            raise InputError(f"The bounds of K cross: {low:g} must be above 0 and below {high:g}.")


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The performer, and how it came about."""

    performer: Performer
    default: Performer
    """What `retarget run` makes of the neutral alone."""
    layout: MarkerLayout
    rig: Rig
    material: Material
    face: FaceSites
    laid: LaidOut
    """In the performer's ``head``."""
    turn: HeadTurn
    """From the default's head to the performer's."""
    motion: Motion
    jaw: JawFit | None
    extremes: tuple[RigExtreme, ...]
    matches: tuple[Match, ...]
    wanted: Gains
    """K before bounds and fixed values."""
    pairs: Pairs
    strength: float
    score: HeldOut | None
    jaw_wanted: float | None
    """The jaw's gain before its bounds; None where the jaw did not open."""
    bounds: tuple[float, float]
    seen: Array
    """(2, S, 3) [m]: the farthest to the positive side of each axis, and to the negative."""
    rig_seen: Array
    """(2, S, 3) [m]: the same of the rig's own extremes."""


def calibrate(
    material: Material,
    layout: MarkerLayout,
    rig: Rig,
    settings: Settings,
    on_step: Callable[[str], None] = lambda _: None,
) -> Calibration:
    """A performer for `rig`; InputError where the takes do not allow one, in a sentence that says why."""
    default, _ = performer_from_neutral(
        layout, material.neutral.positions, rig, name=settings.name, date=settings.date, noise=material.neutral.noise
    )
    face = face_sites(layout, default.neutral, rig)
    on_step(STEPS[0])
    laid = lay_out(material.takes, default.neutral)
    on_step(STEPS[1])
    fixed = frozenset(settings.previous.fixed) if settings.previous else frozenset()
    jaw = _jaw(face, default, laid, fixed, settings)
    motion = _motion(face, default.neutral, laid, jaw, rig)
    on_step(STEPS[2])
    rig_range = RigRange(rig, face.names)
    extremes = tuple(rig_range.extremes())
    matches = tuple(find_matches(motion, extremes, face.names, default.scale, _lever(face, default, jaw)))
    graph = site_graph(face.names, rig_range.rest)
    poses = _posed(material, default, face, jaw, rig_range)
    pairs = _all_pairs(poses, pairs_of_matches(matches, extremes, face.names))
    on_step(STEPS[3])
    R = refine_axes(pairs, graph, default.scale)
    strength = choose_strength(poses.turned(R), graph, default.scale)[0] if poses.names else STRENGTH
    gains = solve_gains(pairs.turned(R), graph, default.scale, strength)
    on_step(STEPS[4])
    rest = default.neutral[face.markers]
    score = held_out(deal(motion, matches, extremes, face.names), graph, default.scale, rest, rig_range.rest)
    turned = HeadTurn(R, default.neutral[face.markers].mean(axis=0))
    seen = _farthest(motion.moves @ R.T, motion.times)
    performer, jaw_wanted = make_performer(default, turned, face, gains, jaw, rig_range, matches, settings.bounds)
    ranges = {site: seen[:, i] for i, site in enumerate(face.names) if np.isfinite(seen[:, i]).all()}
    quality = _quality(material, laid, R, jaw, matches, gains, score)
    performer = replace(performer, ranges=ranges, quality=quality)
    performer = with_fixed(performer, settings.previous) if settings.previous else performer
    return Calibration(
        performer=performer,
        default=default,
        layout=layout,
        rig=rig,
        material=material,
        face=face,
        laid=replace(laid, positions=turned.points(laid.positions)),
        turn=turned,
        motion=replace(motion, moves=motion.moves @ R.T, whole=motion.whole @ R.T),
        jaw=jaw,
        extremes=extremes,
        matches=matches,
        wanted=gains,
        pairs=pairs.turned(R),
        strength=strength,
        score=score,
        jaw_wanted=jaw_wanted,
        bounds=settings.bounds,
        seen=seen,
        rig_seen=_extent([extreme.moves for extreme in extremes], len(face.names)),
    )


def _jaw(
    face: FaceSites, default: Performer, laid: LaidOut, fixed: frozenset[str], settings: Settings
) -> JawFit | None:
    """None where rig or layout has no jaw."""
    if default.jaw is None or not face.chin:
        return None
    jaw = default.jaw
    before = settings.previous.jaw if settings.previous else None
    if before:
        jaw = replace(
            jaw,
            axis=before.axis if "jaw.axis" in fixed else jaw.axis,
            pivot=before.pivot if "jaw.pivot" in fixed else jaw.pivot,
        )
    chin = face.markers[face.chin]
    rate_hz = 1.0 / float(np.median(np.diff(laid.times)))
    return fit_jaw(default.neutral[chin], laid.positions[:, chin], rate_hz, jaw, fixed)


def _motion(face: FaceSites, neutral: Array, laid: LaidOut, jaw: JawFit | None, rig: Rig) -> Motion:
    turn = _taken_back(jaw, rig) if jaw else None
    axis, pivot = (jaw.axis, jaw.pivot) if jaw else (np.zeros(3), np.zeros(3))
    moves = site_moves(face, neutral, laid.positions, turn, axis, pivot)
    read = np.zeros(len(laid.times)) if turn is None else turn
    whole = site_moves(face, neutral, laid.positions, None, axis, pivot)
    return Motion(laid.times, moves, whole, read, laid.prompts)


def _taken_back(jaw: JawFit, rig: Rig) -> Array:
    """(T,) the turn that the mapping takes back: what is read, as far as the rig's jaw can close."""
    low = rig.jaw.min_rad if rig.jaw else 0.0
    turn: Array = np.maximum(jaw.motion.read_rad, low)
    return turn


def _lever(face: FaceSites, default: Performer, jaw: JawFit | None) -> float:
    if jaw is None:
        return 0.0
    chin = default.neutral[face.markers[face.chin]].mean(axis=0) - jaw.pivot
    return float(np.linalg.norm(chin - (chin @ jaw.axis) * jaw.axis))


def _posed(material: Material, default: Performer, face: FaceSites, jaw: JawFit | None, rig_range: RigRange) -> Pairs:
    """A pair for each reference pose."""
    poses = []
    for pose in material.poses:
        target = rig_pose(pose.name, rig_range)
        laid = lay_out((RangeTake(pose.recording),), default.neutral)
        motion = _motion(face, default.neutral, laid, _jaw_of_take(face, default, laid, jaw), rig_range.rig)
        poses.append((pose.name, moves_in(motion, held_frames(pose, motion)), target.moves, concerned(target)))
    return make_pairs(poses, len(face.names))


def _jaw_of_take(face: FaceSites, default: Performer, laid: LaidOut, jaw: JawFit | None) -> JawFit | None:
    """The jaw that is known already, as it moves in another take."""
    if jaw is None:
        return None
    chin = face.markers[face.chin]
    rest, path = default.neutral[chin], laid.positions[:, chin]
    return replace(jaw, motion=jaw_motion(rest, path, jaw.axis, jaw.pivot, 1))


def _all_pairs(poses: Pairs, found: Pairs) -> Pairs:
    """The reference poses, and of the expressions found those that no pose of the same name tells better."""
    rest = found.only(np.array([name not in poses.names for name in found.names], bool))
    return poses.joined(rest) if poses.names else found


def _farthest(moves: Array, times: Array) -> Array:
    """(2, S, 3) [m], of what lasts for `RANGE_S`."""
    half = max(round(RANGE_S / float(np.median(np.diff(times))) / 2), 1)
    lasting = rolling_mean(moves, half)
    high = np.nanquantile(lasting, RANGE_SHARE, axis=0)
    low = np.nanquantile(lasting, 1 - RANGE_SHARE, axis=0)
    return np.stack([np.maximum(high, 0.0), np.minimum(low, 0.0)])


def _extent(moves: Sequence[Array], sites: int) -> Array:
    """(2, S, 3) of any number of (S, 3)."""
    every = np.array([np.zeros((sites, 3)), *moves])
    return np.stack([every.max(axis=0), every.min(axis=0)])


def _quality(
    material: Material,
    laid: LaidOut,
    R: Array,
    jaw: JawFit | None,
    matches: Sequence[Match],
    gains: Gains,
    score: HeldOut | None,
) -> dict[str, float]:
    """Numbers by the names in `retarget.performer.QUALITY`."""
    whole = [match for match in matches if not match.side]
    made = sum(any(m.exercised for m in matches if m.name == w.name) for w in whole)
    quality = {
        "neutral_spread_mm": 1e3 * material.neutral.spread_m,
        "head_residual_mm": 1e3 * laid.residual_m,
        "head_axes_deg": float(np.degrees(np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1)))),
        "expressions": float(made),
        "confidence": float(gains.confidence.mean()),
    }
    if jaw:
        quality["jaw_opening_deg"] = float(np.degrees(jaw.opening_rad))
        quality |= {"jaw_residual_mm": 1e3 * jaw.hinge.residual_m} if jaw.hinge else {}
    if score:
        quality |= {
            "held_out_mm": score.calibrated,
            "held_out_k1_mm": score.one,
            "held_out_scale_mm": score.scale,
            "held_out_warp_mm": score.warp,
        }
    return quality
