"""Takes to calibrate with: a neutral, and a range of motion in which the performer makes the rig's own expressions.

What makes K known without reference poses: the performer's full strength of an expression is what the rig's should
become, its extreme. So the synthetic performer goes to the extremes of the rig, each seen through K turned round, in an
order that nobody tells the calibration, twice, with a talking jaw between the rounds. Metres, seconds.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calib.expressions import BY_NAME, side_of
from calib.rig_range import RigRange
from retarget.performer import gain_matrix
from tests.synthetic.capture import captured, with_dropouts, with_noise, with_outliers
from tests.synthetic.face import make_face
from tests.synthetic.motion import FaceMotion, bump, head_motion, syllables

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from calib.rig_range import RigExtreme
    from retarget.frames import MarkerLayout
    from retarget.rig.model import Rig
    from tests.synthetic.capture import SyntheticTake
    from tests.synthetic.face import SyntheticFace

    Array = NDArray[np.float64]

RISE_S, HOLD_S, FALL_S, REST_S = 0.4, 0.8, 0.4, 0.3
EXPRESSION_S = RISE_S + HOLD_S + FALL_S + REST_S
SPEECH_S = 5.0
OPENINGS = 3
NOISE_M = 0.0003
DROPOUTS, OUTLIERS = 0.10, 0.05


def person(rig: Rig, layout: MarkerLayout, rng: np.random.Generator) -> SyntheticFace:
    """A face as `make_face` makes it, with a K of its own for every site, axis and direction.

    K lies between 0.4 and 0.9 of the ratio of sizes: within the default bounds, whose upper end is known no better than
    the sizes of two different faces can be compared. The jaw's gain lies between 0.6 and 0.95.
    """
    face = make_face(rig, layout, rng)
    K = {site: gain_matrix(face.performer.scale * rng.uniform(0.4, 0.9, (2, 3))) for site in face.performer.K}
    jaw = face.performer.jaw
    if jaw is None:
        raise ValueError("A performer to calibrate needs a jaw.")
    return replace(face, performer=replace(face.performer, K=K, jaw=replace(jaw, gain=rng.uniform(0.6, 0.95))))


def neutral_take(
    face: SyntheticFace, rng: np.random.Generator, rate_hz: float = 120.0, seconds: float = 3.0
) -> SyntheticTake:
    """The face at rest on a head that sways."""
    times = np.arange(round(seconds * rate_hz)) / rate_hz
    sites = tuple(face.rig.sites)
    still = FaceMotion(
        times,
        sites,
        np.zeros((len(times), len(sites), 3)),
        np.zeros(len(times)),
        head_motion(times, rng, 0.3 + 0 * times),
    )
    return captured(face, still)


def range_of_motion(
    face: SyntheticFace,
    rng: np.random.Generator,
    rate_hz: float = 120.0,
    only: Sequence[str] | None = None,
    rounds: int = 2,
    still_sides: Mapping[str, str] | None = None,
) -> SyntheticTake:
    """Every expression of the rig (or of `only`) `rounds` times in any order, with speech after the first round.

    `still_sides` names expressions that are made without their Left or Right. The mouth opens `OPENINGS` times as often
    as the rest: its hinge is what a short arc tells least of.
    """
    rig_range = RigRange(face.rig, tuple(face.rig.sites))
    extremes = [e for e in rig_range.extremes() if only is None or e.name in only]
    extremes = [_without_side(e, rig_range.sites, (still_sides or {}).get(e.name, "")) for e in extremes]
    extremes += [e for e in extremes if e.name == "jawOpen"] * (OPENINGS - 1)
    order = [extremes[i] for _ in range(rounds) for i in rng.permutation(len(extremes))]
    seconds = REST_S + EXPRESSION_S * len(order) + SPEECH_S
    times = np.arange(round(seconds * rate_hz)) / rate_hz
    moves = np.zeros((len(times), len(rig_range.sites), 3))
    jaw_rad = np.zeros(len(times))
    start = REST_S
    for number, extreme in enumerate(order):
        if number == len(extremes):
            jaw, _, _ = syllables(times, rng, start, start + SPEECH_S)
            jaw_rad += 0.4 * rig_range.jaw_rad * np.minimum(jaw, 1.0) * (only is None or "jawOpen" in only)
            start += SPEECH_S
        strength = bump(times, start, RISE_S, HOLD_S, FALL_S)
        moves += strength[:, None, None] * extreme.moves
        jaw_rad += strength * extreme.jaw_rad
        start += EXPRESSION_S
    T_world_head = head_motion(times, rng, np.ones(len(times)))
    return captured(face, FaceMotion(times, rig_range.sites, moves, jaw_rad, T_world_head))


def mimicked(
    face: SyntheticFace, rng: np.random.Generator, shapes: Sequence[str], rate_hz: float = 120.0
) -> tuple[SyntheticTake, dict[str, tuple[float, float]]]:
    """Named poses of the rig one after the other, and from when to when [s] each is held."""
    rig_range = RigRange(face.rig, tuple(face.rig.sites))
    times = np.arange(round((REST_S + EXPRESSION_S * len(shapes)) * rate_hz)) / rate_hz
    moves, jaw_rad = np.zeros((len(times), len(rig_range.sites), 3)), np.zeros(len(times))
    spans = {}
    for number, name in enumerate(shapes):
        start = REST_S + number * EXPRESSION_S
        weights = dict.fromkeys(BY_NAME[name].shapes if name in BY_NAME else name.split("+"), 1.0)
        extreme = rig_range.extreme(name, weights)
        if extreme is None:
            raise ValueError(f"The rig has no pose {name}.")
        strength = bump(times, start, RISE_S, HOLD_S, FALL_S)
        moves += strength[:, None, None] * extreme.moves
        jaw_rad += strength * extreme.jaw_rad
        spans[name] = (start + RISE_S, start + RISE_S + HOLD_S)
    T_world_head = head_motion(times, rng, np.ones(len(times)))
    return captured(face, FaceMotion(times, rig_range.sites, moves, jaw_rad, T_world_head)), spans


def rough(take: SyntheticTake, rng: np.random.Generator) -> SyntheticTake:
    """As cameras see it on a bad day: 0.3 mm noise, a tenth of all samples missing, a twentieth off by 5 to 30 mm."""
    noisy = with_noise(take, rng, NOISE_M)
    return with_outliers(with_dropouts(noisy, rng, DROPOUTS), rng, OUTLIERS)


def _without_side(extreme: RigExtreme, sites: Sequence[str], side: str) -> RigExtreme:
    """The same with the sites of one side, and those in the middle, at rest."""
    if not side:
        return extreme
    moving = np.array([side_of(site) not in ("", side) for site in sites])
    return replace(extreme, moves=extreme.moves * moving[:, None])
