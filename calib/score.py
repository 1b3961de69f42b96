"""How well a calibration predicts what it has not seen, in millimetres of the rig, against simpler ways.

The times that the performer made each expression are dealt into two hands; K is fitted to one and asked for the other,
then the other way round. Beside it stand K = 1, K = the ratio of sizes, and a warp of the performer's neutral onto the
rig's by radial basis functions (thin plates), which carries every marker along.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.axes import refine_axes
from calib.gains import predicted, solve_gains

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from calib.pairs import Pairs

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


def held_out(hands: tuple[Pairs, Pairs], graph: Array, scale: float, rest: Array, rig_rest: Array) -> HeldOut | None:
    """The score; `rest` (S, 3) and `rig_rest` (S, 3) are the neutral sites of both. None where a hand is empty.

    The warp is of the neutral in `rest`, whose axes are those of the pairs.
    """
    squares: dict[str, list[Array]] = {"calibrated": [], "one": [], "scale": [], "warp": []}
    poses = 0
    for fitted, asked in (hands, hands[::-1]):
        if not fitted.names or not asked.names:
            return None
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
