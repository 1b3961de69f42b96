"""How well a calibration predicts what it has not seen, in millimetres of the rig, against simpler ways.

The times that the performer made an expression are dealt into two hands; K is fitted to one and asked for the other,
then the other way round. What was made only once is fitted to and never asked for. Beside
it stand K = 1, K = the ratio of sizes, and a warp of the performer's neutral onto the rig's by radial basis functions
(thin plates), which carries every marker along.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.axes import refine_axes
from calib.gains import predicted, solve_gains
from calib.matching import episodes, moves_in
from calib.pairs import pairs_of_matches

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from calib.matching import Match, Motion
    from calib.pairs import Pairs
    from calib.rig_range import RigExtreme

    Array = NDArray[np.float64]

MOVED_M = 0.001
"""Sites that the rig moves by less than this in a pose do not count there [m]."""


@dataclass(frozen=True, slots=True)
class HeldOut:
    """RMS errors [mm] over the same poses and sites."""

    calibrated: float
    one: float
    scale: float
    warp: float
    poses: int
    """Poses that were held out."""


@dataclass(frozen=True, slots=True, eq=False)
class Hands:
    """The same expressions, seen at different times, and those that were made only once."""

    first: Pairs
    second: Pairs
    once: Pairs


def deal(motion: Motion, matches: Sequence[Match], extremes: Sequence[RigExtreme], sites: Sequence[str]) -> Hands:
    """The episodes of every match, dealt in turns."""
    times = [episodes(match, motion.times) if match.exercised else [] for match in matches]
    nothing = np.full((len(sites), 3), np.nan)

    def pairs(chosen: list[list[NDArray[np.intp]]]) -> Pairs:
        moves = [moves_in(motion, np.concatenate(frames)) if frames else nothing for frames in chosen]
        return pairs_of_matches(matches, extremes, sites, moves)

    return Hands(
        first=pairs([frames[::2] if len(frames) > 1 else [] for frames in times]),
        second=pairs([frames[1::2] for frames in times]),
        once=pairs([frames if len(frames) == 1 else [] for frames in times]),
    )


def held_out(hands: Hands, graph: Array, scale: float, rest: Array, rig_rest: Array) -> HeldOut | None:
    """The score, None where no expression was made twice; `rest` and `rig_rest` (S, 3) [m] are both neutrals.

    The axes of `rest` are those of the pairs.
    """
    squares: dict[str, list[Array]] = {"calibrated": [], "one": [], "scale": [], "warp": []}
    poses = 0
    if not hands.first.names or not hands.second.names:
        return None
    for known, asked in ((hands.first, hands.second), (hands.second, hands.first)):
        fitted = known.joined(hands.once)
        R = refine_axes(fitted, graph, scale)
        turned = asked.turned(R)
        K = solve_gains(fitted.turned(R), graph, scale).K
        counts = (asked.weights > 0) & (np.linalg.norm(asked.rig, axis=-1) > MOVED_M)
        answers = {
            "calibrated": predicted(K, turned.seen),
            "one": asked.seen,
            "scale": scale * asked.seen,
            "warp": _warped(rest, rig_rest, asked.seen),
        }
        for name, answer in answers.items():
            squares[name].append(((answer - asked.rig) ** 2).sum(axis=-1)[counts])
        poses += len(asked.names)
    rms = {name: 1e3 * float(np.sqrt(np.concatenate(parts).mean())) for name, parts in squares.items()}
    return HeldOut(**rms, poses=poses)


def _warped(rest: Array, rig_rest: Array, moves: Array) -> Array:
    """(P, S, 3): where the warp that takes `rest` to `rig_rest` carries sites that have moved."""
    from scipy.interpolate import RBFInterpolator

    warp = RBFInterpolator(rest, rig_rest, kernel="thin_plate_spline")
    carried: Array = warp((rest + moves).reshape(-1, 3)).reshape(moves.shape) - rig_rest
    return carried
