"""What a person should know about a calibration, in sentences: what was never exercised, and what is doubtful."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from calib.expressions import BY_NAME
from calib.stabilised import exchangeable
from retarget.performer import DIRECTIONS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from calib.calibration import Calibration

Kind = Literal["missing", "doubt", "note"]

SURE = 0.5
"""Confidence from which on a value is the data's own."""
OFTEN_MISSING = 0.2
OFTEN_SPIKES = 0.08
LOOSE_HEAD_MM = 1.5
NOISY_M = 0.001
SHOWN = 6


@dataclass(frozen=True, slots=True)
class Finding:
    """One sentence."""

    kind: Kind
    """`missing` was never exercised, `doubt` may need another take or a look, `note` is good to know."""
    text: str


def findings(calibration: Calibration) -> list[Finding]:
    """All that is worth saying, the most important first."""
    return [
        *_never(calibration),
        *_jaw(calibration),
        *_bounds(calibration),
        *_head(calibration),
        *_markers(calibration),
        *_score(calibration),
        *_fixed(calibration),
    ]


def _never(calibration: Calibration) -> Iterator[Finding]:
    """Expressions that were not made: of one side, or of both."""
    for name in dict.fromkeys(match.name for match in calibration.matches):
        matches = [match for match in calibration.matches if match.name == name]
        sides = [match for match in matches if match.side]
        idle = [match.side for match in sides if not match.exercised]
        if not any(match.exercised for match in matches):
            yield Finding("missing", _sentence(BY_NAME[name].never.format(side="left and right ")))
        elif len(idle) == 1:
            yield Finding("missing", _sentence(BY_NAME[name].never.format(side=f"{idle[0].lower()} ")))
    if calibration.extremes and not any(match.exercised for match in calibration.matches):
        text = "no expression was found, so every K is the ratio of sizes: record a range of motion with larger ones"
        yield Finding("missing", _sentence(text))
    if not calibration.extremes:
        yield Finding("doubt", f"The rig {calibration.rig.name} has no shapes that tell its range, so K is left alone.")


def _jaw(calibration: Calibration) -> Iterator[Finding]:
    jaw = calibration.jaw
    if jaw is None:
        if calibration.rig.jaw is not None:
            yield Finding("missing", "No marker is at the chin or the lower lip, so the jaw does not move.")
        return
    if jaw.complaint:
        yield Finding("missing", jaw.complaint)
    if jaw.hinge and jaw.hinge.path_sd_m > 2 * jaw.hinge.pivot_sd_m:
        yield Finding(
            "doubt",
            f"The chin's path alone leaves the hinge open by {_mm(jaw.hinge.path_sd_m)} along one direction, as skin "
            "slides over the bone; there the hinge is mostly the rig's.",
        )
    low, high = calibration.bounds
    wanted = calibration.jaw_wanted
    if wanted is not None and not 0.98 * low <= wanted <= 1.02 * high:
        held = low if wanted < low else high
        yield Finding("doubt", f"The jaw's gain would be {wanted:.2f} and is held at its bound, {held:g}.")


def _bounds(calibration: Calibration) -> Iterator[Finding]:
    """K beyond its bounds where the data are sure of it."""
    ratio = calibration.wanted.K / calibration.performer.scale
    low, high = calibration.bounds
    beyond = np.maximum(low - ratio, ratio - high)
    beyond[calibration.wanted.confidence < SURE] = 0.0
    worst = sorted(zip(*np.nonzero(beyond > 0.05), strict=True), key=lambda at: -float(beyond[at]))
    if worst:
        named = [f"{_direction_name(calibration, *map(int, at))} {ratio[at]:.2f}" for at in worst[:SHOWN]]
        more = f" and {len(worst) - SHOWN} more" if len(worst) > SHOWN else ""
        yield Finding(
            "doubt",
            f"K is held at its bounds, {low:g} to {high:g} times the ratio of sizes, where the performer went much "
            f"farther or less far than the rig does: {', '.join(named)}{more}.",
        )


def _direction_name(calibration: Calibration, sign: int, site: int, axis: int) -> str:
    return f"{calibration.face.names[site]} {DIRECTIONS[axis][sign]}"


def _head(calibration: Calibration) -> Iterator[Finding]:
    performer = calibration.performer
    same = exchangeable(performer.head_template, performer.head_markers)
    if same:
        yield Finding(
            "doubt",
            f"The head markers {' and '.join(same[0])} could exchange their names unnoticed (they fit within "
            f"{_mm(same[1])}); move one by a centimetre or two.",
        )
    if performer.quality.get("head_residual_mm", 0.0) > LOOSE_HEAD_MM:
        yield Finding(
            "doubt",
            f"The head markers stray {performer.quality['head_residual_mm']:.1f} mm about a rigid head; skin carries "
            "them, or the band slips.",
        )


def _markers(calibration: Calibration) -> Iterator[Finding]:
    names = calibration.layout.names
    unseen = np.isnan(calibration.performer.neutral.sum(axis=1))
    if unseen.any():
        yield Finding("missing", f"Not seen in the neutral, so left at rest: {_listed(names, unseen)}.")
    missing = (calibration.laid.missing > OFTEN_MISSING) & ~unseen
    if missing.any():
        yield Finding("doubt", f"Not seen for more than a fifth of the time: {_listed(names, missing)}.")
    jumping = calibration.laid.spikes > OFTEN_SPIKES
    if jumping.any():
        yield Finding("doubt", f"Jumping off their path again and again: {_listed(names, jumping)}.")
    noisy = np.nan_to_num(calibration.performer.noise) > NOISY_M
    if noisy.any():
        yield Finding("doubt", f"Noisy at rest, by more than {_mm(NOISY_M)}: {_listed(names, noisy)}.")


def _score(calibration: Calibration) -> Iterator[Finding]:
    score = calibration.score
    if score is None:
        yield Finding("note", "No expression was made twice, so nothing could be held out to judge the calibration by.")
    elif score.calibrated >= min(score.one, score.scale):
        yield Finding(
            "doubt", "On what was held out the calibration is no better than the ratio of sizes; record a cleaner take."
        )


def _fixed(calibration: Calibration) -> Iterator[Finding]:
    if calibration.performer.fixed:
        yield Finding("note", f"Kept as set by hand: {', '.join(calibration.performer.fixed)}.")


def _listed(names: tuple[str, ...], chosen: np.ndarray) -> str:
    found = [name for name, is_one in zip(names, chosen.tolist(), strict=True) if is_one]
    return ", ".join(found[:SHOWN]) + (f" and {len(found) - SHOWN} more" if len(found) > SHOWN else "")


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:] + "."


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.1f} mm" if metres < 0.0095 else f"{1e3 * metres:.0f} mm"
