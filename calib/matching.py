"""Where in a range of motion the performer made which of the rig's expressions, and how far every site went then.

A frame belongs to the expression whose field of displacements it resembles most, by the cosine between the two, which
does not ask how strong either is. Of the frames of an expression those near its largest lasting strength count; every
site's displacement is their median. Expressions that a performer can make with one side alone are looked for on each
side by itself. Metres and radians; the performer's ``head``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.expressions import BY_NAME, side_of
from calib.rig_range import CLOSED_RAD
from calib.rolling import rolling_mean

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from calib.rig_range import RigExtreme

    Array = NDArray[np.float64]
    Mask = NDArray[np.bool_]

ALIKE = 0.5
"""Cosine from which on a frame can show an expression."""
EXERCISED = 0.3
"""Part of the rig's own strength (at the performer's size) below which an expression was not made."""
NEAR_TOP = 0.88
LASTING_S = 0.1
BRIEFEST_S = 0.15
"""What lasts for less, near its strongest, was no expression."""
LEAST_SEEN = 0.3
"""Part of the frames in which a site must be seen."""
APART_S = 0.5
"""Longer pauses between frames of one expression part it into episodes."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A performer's face over a whole range of motion, (T, ...)."""

    times: Array
    """(T,) [s]; takes one after the other."""
    moves: Array
    """(T, S, 3) [m] from the neutral, the jaw's turn taken back; NaN where not seen."""
    whole: Array
    """(T, S, 3) [m], the same with the jaw's turn left in."""
    turn_rad: Array
    """(T,) of the performer's jaw; NaN where not read."""
    prompts: tuple[str, ...] = ()
    """What the performer was asked for in each frame, (T,) or nothing; "" where it is not known."""


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """The performer at the end of an expression, on one side or as a whole."""

    name: str
    side: str
    """"Left", "Right" or ""."""
    share: float
    """Strength over the rig's own, at the performer's size; 0 where it was not made."""
    likeness: float
    """Cosine with the rig's expression."""
    moves: Array
    """(S, 3) [m]; NaN where not known."""
    turn_rad: float
    frames: NDArray[np.intp]
    """Those that count."""
    top: int
    """The strongest of them, -1 where there is none."""

    @property
    def exercised(self) -> bool:
        """True where it was made."""
        return self.top >= 0


def find_matches(
    motion: Motion, extremes: Sequence[RigExtreme], sites: Sequence[str], scale: float, lever_m: float
) -> list[Match]:
    """For every extreme of the rig as a whole, and for each side where the sides can go apart; also those not made.

    `scale` is the rig's size over the performer's; `lever_m` the chin's distance from the hinge, which weighs the jaw's
    turn against displacements.
    """
    if not extremes:
        return []
    sides = np.array([side_of(site) for site in sites])
    parts: dict[str, Mask] = {"": np.ones(len(sites), bool)}
    parts |= {side: sides == side for side in ("Left", "Right") if (sides == side).any()}
    matches = []
    for side, part in parts.items():
        likeness, strength, full = _compare(motion, extremes, part, scale, lever_m)
        best = np.argmax(likeness, axis=1)
        for e, extreme in enumerate(extremes):
            if side and not (BY_NAME[extreme.name].sides and np.abs(extreme.moves[part]).max(initial=0.0) > 5e-4):
                continue
            shows = (best == e) & (likeness[:, e] > ALIKE) & _asked(motion, extreme.name)
            matches.append(_match(motion, extreme.name, side, shows, likeness[:, e], strength[:, e], full[e]))
    return matches


def _asked(motion: Motion, name: str) -> Mask:
    if not motion.prompts:
        return np.ones(len(motion.times), bool)
    return np.array([prompt in ("", name) for prompt in motion.prompts])


def _compare(
    motion: Motion, extremes: Sequence[RigExtreme], part: Mask, scale: float, lever_m: float
) -> tuple[Array, Array, Array]:
    """Cosine (T, E), strength along the expression (T, E) [m], and the rig's own strength (E,) [m]."""
    turns = lever_m * motion.turn_rad[:, None]
    ours = np.concatenate([motion.moves[:, part].reshape(len(motion.times), -1), turns], axis=1)
    theirs = np.array([[*(e.moves[part] / scale).ravel(), lever_m * e.jaw_rad] for e in extremes])
    seen = np.isfinite(ours)
    ours = np.where(seen, ours, 0.0)
    along = ours @ theirs.T
    lengths = np.sqrt(np.maximum(seen @ (theirs**2).T, 1e-12))
    likeness = along / np.maximum(np.linalg.norm(ours, axis=1)[:, None] * lengths, 1e-9)
    return likeness, along / lengths, np.linalg.norm(theirs, axis=1)


def _match(motion: Motion, name: str, side: str, shows: Mask, likeness: Array, strength: Array, full: float) -> Match:
    rate_hz = 1.0 / float(np.median(np.diff(motion.times)))
    shown = np.where(shows, strength, np.nan)
    lasting = rolling_mean(shown, max(round(LASTING_S * rate_hz / 2), 1))
    enough = rolling_mean(shows.astype(float), max(round(LASTING_S * rate_hz / 2), 1)) > 0.5
    lasting = np.where(enough & shows, lasting, -np.inf)
    top = int(np.argmax(lasting))
    frames = np.flatnonzero(lasting >= NEAR_TOP * lasting[top])
    if lasting[top] < EXERCISED * full or len(frames) < BRIEFEST_S * rate_hz:
        share = max(float(lasting[top]) / full, 0.0) if np.isfinite(lasting[top]) else 0.0
        return Match(name, side, share, 0.0, np.full(motion.moves.shape[1:], np.nan), np.nan, np.zeros(0, np.intp), -1)
    turn = motion.turn_rad[frames]
    return Match(
        name=name,
        side=side,
        share=float(lasting[top]) / full,
        likeness=float(np.median(likeness[frames])),
        moves=moves_in(motion, frames),
        turn_rad=float(np.nanmedian(turn)) if np.isfinite(turn).any() else np.nan,
        frames=frames,
        top=top,
    )


def episodes(match: Match, times: Array) -> list[NDArray[np.intp]]:
    """The frames of a match, apart for every time that the performer made the expression."""
    steps = np.diff(times[match.frames])
    return np.split(match.frames, np.flatnonzero((steps > APART_S) | (steps < 0)) + 1)


def moves_in(motion: Motion, frames: NDArray[np.intp]) -> Array:
    """(S, 3) [m] over some frames, without the jaw's turn where the mouth is open in them; NaN where not seen.

    A nearly closed mouth that reads some turn is muscles at work on the chin, and nothing is taken back.
    """
    turns = motion.turn_rad[frames]
    opened = np.isfinite(turns).any() and float(np.nanmedian(turns)) > CLOSED_RAD
    return median_of((motion.moves if opened else motion.whole)[frames])


def median_of(moves: Array) -> Array:
    """(S, 3): over the frames of (F, S, 3); NaN where a site was seen in too few of them."""
    seen = np.isfinite(moves.sum(axis=2)).mean(axis=0) >= LEAST_SEEN
    median = np.full(moves.shape[1:], np.nan)
    if seen.any():
        median[seen] = np.nanmedian(moves[:, seen], axis=0)
    return median
