"""The still face out of a take: its quietest stretch, a robust mean for each marker, and the noise floor.

The take is laid onto one of its own frames by the head markers, spikes go, and the spread of every marker is taken over
windows of two, one and half a second; the longest length at which a window is still wins, and of these the quietest.
The mean starts as the geometric median (Weiszfeld 1937), which neither outliers nor a blink pull away, and is then the
plain mean of what lies near it. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.rigid_fits import LEAST
from calib.rolling import window_sums
from calib.stabilised import stabilised
from retarget.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from calib.recording import Recording

    Array = NDArray[np.float64]

LENGTHS_S = (2.0, 1.0, 0.5)
FACE_M = 0.001
"""A still face strays by this at most, RMS over its markers [m]."""
MARKER_M = 0.0025
"""And each of its markers by this [m]."""
ENOUGH = 0.6
"""Part of the markers that a still window must show."""
NEAR = 2.5
WEISZFELD_STEPS = 20


@dataclass(frozen=True, slots=True, eq=False)
class StillFace:
    """A neutral, not yet in anybody's ``head``."""

    recording: str
    positions: Array
    """(M, 3) [m], ``world`` at the pose of one frame; NaN where a marker was not seen."""
    noise: Array
    """(M,) [m], standard deviation in space; NaN as above."""
    start_s: float
    end_s: float
    """The stretch, from the take's first frame."""
    frames: int
    spread_m: float
    """RMS of all markers in the stretch [m]."""


def find_neutral(recording: Recording, first_s: float | None = None) -> StillFace:
    """The still face of `recording`, or of its first `first_s` seconds.

    InputError where it is too short, where the head markers are missing, and where it is nowhere still; it says why.
    """
    if first_s is not None:
        recording = recording.part(0.0, first_s)
    if recording.seconds < 0.9 * LENGTHS_S[-1]:
        raise InputError(
            f"{recording.name} is too short for a neutral: it lasts {recording.seconds:.2f} s, and half a second of a "
            "resting face is needed, better two."
        )
    laid = _laid(recording)
    lengths = [s for s in LENGTHS_S if s <= recording.seconds + 0.1]
    for seconds in lengths:
        frames = min(recording.frames_in(seconds), len(laid))
        spreads = _spreads(laid, frames)
        score = _score(spreads, laid)
        at = int(np.argmin(score))
        if score[at] <= FACE_M and np.nanmax(spreads[at]) <= MARKER_M:
            return _still_face(recording, laid, at, frames, float(score[at]))
    raise _not_still(recording, spreads[at], at, frames, float(score[at]))


def _laid(recording: Recording) -> Array:
    """(T, M, 3) [m]: every frame laid onto the head markers of one, and then onto where these usually are.

    A head marker that was misread in the first one is put right by the second.
    """
    template = _one_frame(recording)
    for _ in range(2):
        laid = stabilised(recording, template).positions
        template = geometric_median(laid[:, list(recording.layout.head)])
    return laid


def _one_frame(recording: Recording) -> Array:
    """The head markers (H, 3) of the frame that shows most of them, and among these of most others."""
    seen = np.isfinite(recording.world.sum(axis=2))
    head = list(recording.layout.head)
    best = int(np.argmax(seen[:, head].sum(axis=1) * (1 + seen.shape[1]) + seen.sum(axis=1)))
    if seen[best, head].sum() < LEAST:
        names = ", ".join(recording.layout.names[i] for i in head)
        raise InputError(f"Head markers are missing in {recording.name}: no frame shows three of {names}.")
    template: Array = recording.world[best, head]
    return template


def _spreads(laid: Array, frames: int) -> Array:
    """(W, M) [m]: RMS distance of each marker from its mean, over each window of `frames` frames; NaN where unseen."""
    half = (frames - 1) // 2  # the window 2 half + 1 fits into the recording even where that is just as long
    centred = laid - np.nanmedian(np.where(np.isfinite(laid).any(axis=0), laid, 0.0), axis=0)  # keeps sums small
    sums, seen = window_sums(centred, half)
    squares, _ = window_sums(centred**2, half)
    inside = slice(half, len(laid) - half)
    count = np.where(seen[inside] >= half / 2, seen[inside], np.nan)
    variance = squares[inside] / count - (sums[inside] / count) ** 2
    spread: Array = np.sqrt(np.maximum(variance, 0.0).sum(axis=2))
    return spread


def _score(spreads: Array, laid: Array) -> Array:
    """(W,) [m]: RMS over the markers, infinite where too few of those ever seen are seen."""
    shown = np.isfinite(spreads).sum(axis=1)
    needed = max(LEAST, ENOUGH * float(np.isfinite(laid).all(axis=2).any(axis=0).sum()))
    mean = np.nan_to_num(spreads**2).sum(axis=1) / np.maximum(shown, 1)
    return np.where(shown >= needed, np.sqrt(mean), np.inf)


def _still_face(recording: Recording, laid: Array, at: int, frames: int, score: float) -> StillFace:
    stretch = slice(at, min(at + 2 * ((frames - 1) // 2) + 1, len(laid)))
    near = _near(laid[stretch], geometric_median(laid[stretch]))
    seen = np.isfinite(near.sum(axis=2)).any(axis=0)
    centre, noise = np.full(laid.shape[1:], np.nan), np.full(laid.shape[1], np.nan)
    centre[seen] = np.nanmean(near[:, seen], axis=0)
    noise[seen] = np.sqrt(np.nansum(np.nanvar(near[:, seen], axis=0), axis=1))
    since = recording.times[stretch] - recording.times[0]
    return StillFace(
        recording.name, centre, noise, float(since[0]), float(since[-1]), stretch.stop - stretch.start, score
    )


def _near(points: Array, centre: Array) -> Array:
    """The points (T, M, 3), NaN where they are farther from their centre (M, 3) than the usual by `NEAR` times."""
    distances = np.linalg.norm(points - centre, axis=2)
    seen = np.isfinite(distances).any(axis=0)
    usual = np.full(len(centre), np.nan)
    usual[seen] = np.nanmedian(distances[:, seen], axis=0)
    return np.where((distances <= NEAR * usual)[..., None], points, np.nan)


def geometric_median(points: Array) -> Array:
    """(M, 3): of points (T, M, 3), for each M the place of the least sum of distances; NaN where none was seen."""
    seen = np.isfinite(points.sum(axis=2))
    known = seen.any(axis=0)
    centre = np.full(points.shape[1:], np.nan)
    centre[known] = np.nanmedian(points[:, known], axis=0)
    filled = np.where(seen[..., None], points, 0.0)
    for _ in range(WEISZFELD_STEPS):
        distances = np.linalg.norm(np.where(seen[..., None], points - centre, 0.0), axis=2)
        weights = seen / np.maximum(distances, 1e-6)
        centre[known] = ((weights[..., None] * filled).sum(axis=0) / weights.sum(axis=0)[:, None].clip(1e-9))[known]
    return centre


def _not_still(recording: Recording, spread: Array, at: int, frames: int, score: float) -> InputError:
    if not np.isfinite(score):
        return InputError(
            f"{recording.name} has no still stretch: nowhere are {100 * ENOUGH:.0f} % of its markers seen for "
            f"{frames / recording.rate_hz:.1f} s."
        )
    worst = int(np.nanargmax(spread))
    since = recording.times[at] - recording.times[0]
    return InputError(
        f"{recording.name} has no still stretch: even in the {frames / recording.rate_hz:.1f} s from {since:.1f} s the "
        f"markers stray {1000 * score:.1f} mm ({recording.layout.names[worst]} {1000 * spread[worst]:.1f} mm; at most "
        f"{1000 * FACE_M:.0f} and {1000 * MARKER_M:.1f} mm are allowed), so record a face that rests."
    )
