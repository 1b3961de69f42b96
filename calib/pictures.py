"""The rig at the performer's extremes, before and after the calibration, as PNG texts for a page."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import DisplayError
from retarget.frames import MarkerFrame
from retarget.rig.joints import JointMapping

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from calib.calibration import Calibration
    from calib.matching import Match
    from retarget.frames import Pose
    from retarget.performer import Performer

    Array = NDArray[np.float64]

WIDTH, HEIGHT = 230, 270
BACKGROUND = (240, 242, 245)
TURN_RAD = 0.28
"""Somewhat from the side, so that what goes forward is seen too."""


@dataclass(frozen=True, slots=True)
class Extreme:
    """An expression of the performer on the rig, twice."""

    name: str
    before: str
    """PNG, base64: with K the ratio of sizes, and the rig's hinge."""
    after: str


def pictures(calibration: Calibration) -> tuple[list[Extreme], str]:
    """Every expression that was made, and "" or why there is no picture."""
    from retarget.rig.display.offscreen import Offscreen
    from retarget.rig.display.view import View

    view = View(WIDTH, HEIGHT, BACKGROUND, framing="face", yaw_rad=TURN_RAD, supersampling=2)
    before, after = _mapping(calibration, calibration.default), _mapping(calibration, calibration.performer)
    extremes = []
    try:
        with Offscreen(calibration.rig, view) as display:
            for match in _shown(calibration):
                p = _positions(calibration, match)
                extremes.append(
                    Extreme(
                        name=match.name + (f", {match.side.lower()}" if match.side else ""),
                        before=_png(display.render(before(calibration.turn.points_before(p)))),
                        after=_png(display.render(after(p))),
                    )
                )
    except DisplayError as error:
        return [], str(error)
    return extremes, ""


def _shown(calibration: Calibration) -> list[Match]:
    """The whole expression where it was made, else the sides that made it."""
    made = [match for match in calibration.matches if match.exercised]
    whole = {match.name for match in made if not match.side}
    return [match for match in made if not match.side or match.name not in whole]


def _mapping(calibration: Calibration, performer: Performer) -> Callable[[Array], Pose]:
    mapping = JointMapping(calibration.rig, calibration.layout, performer)

    def solve(positions: Array) -> Pose:
        return mapping(MarkerFrame(0, 0.0, 0.0, calibration.layout, positions, np.eye(4)))

    return solve


def _positions(calibration: Calibration, match: Match) -> Array:
    """(M, 3) [m]: the markers while the expression lasts; the neutral where one was not seen."""
    frames = calibration.laid.positions[match.frames]
    shown = np.isfinite(frames.sum(axis=2)).any(axis=0)
    positions = calibration.performer.neutral.copy()
    positions[shown] = np.nanmedian(frames[:, shown], axis=0)
    return positions


def _png(picture: NDArray[np.uint8]) -> str:
    import cv2

    _, encoded = cv2.imencode(".png", picture[..., ::-1])
    return base64.b64encode(encoded.tobytes()).decode()
