"""The neutral face, found by itself: the first moment in which the face holds still.

A window of consecutive frames is still when, after its rigid motion is taken out, the markers stray little from their
means: all of them together, and each for itself, as a closing lid or one lip is few among many. The window is a count
of frames, so a take replayed at another speed gives the same neutral. Positions are metres, ``world``.
"""

from __future__ import annotations

import logging
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame

    Array = NDArray[np.float64]

log = logging.getLogger("retarget.markers")

LEAST = 3
"""Markers that a rigid motion needs."""
ENOUGH = 0.75
"""Share of the markers seen so far that a still window must show throughout."""


@dataclass(frozen=True, slots=True, eq=False)
class Neutral:
    """The face at rest."""

    positions: Array
    """(M, 3) [m], ``world``, at the pose of the window's first frame; NaN where a marker was not seen in the window."""
    spread_m: Array
    """(M,) RMS distance from the mean [m], the noise floor; NaN as above."""
    first_number: int
    last_number: int
    """Numbers of the window's frames."""
    still: bool
    """False where no still moment was found, and this is the quietest."""


class StillMoment:
    """Fed with labelled frames in ``world``, one by one, until it gives the neutral face.

    Frames with fewer than three markers, as before the performer comes into view, are passed over. `give_up` frames
    after the first, the quietest window so far is taken, with a warning in the log.
    """

    def __init__(self, window: int = 30, face_m: float = 0.001, marker_m: float = 0.002, give_up: int = 600) -> None:
        """`window` and `give_up` [frames]; `face_m` and `marker_m` [m] RMS from the mean, of all markers and of each.

        A marker that moves evenly by 7 mm within the window strays by 2 mm.
        """
        self.window = window
        self.face_m = face_m
        self.marker_m = marker_m
        self.give_up = give_up
        self.reset()

    def reset(self) -> None:
        """Start anew."""
        self._frames: deque[MarkerFrame] = deque(maxlen=self.window)
        self._seen_ever: NDArray[np.bool_] | None = None
        self._fed = 0
        self._quietest: Neutral | None = None
        self._least_m = np.inf

    def feed(self, frame: MarkerFrame) -> Neutral | None:
        """The neutral, as soon as `frame` completes a still window or patience ends; else None."""
        seen: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(frame.positions), axis=1)
        if seen.sum() < LEAST:
            self._frames.clear()
            return None
        self._seen_ever = seen if self._seen_ever is None else np.logical_or(seen, self._seen_ever)
        self._fed += 1
        self._frames.append(frame)
        if len(self._frames) == self.window:
            self._measure(max(LEAST, ENOUGH * int(self._seen_ever.sum())))
        if self._quietest is not None and self._quietest.still:
            return self._quietest
        return self.settle() if self._fed >= self.give_up else None

    def settle(self) -> Neutral:
        """The quietest window so far; where there is none, the last frames, or the last; logs a warning.

        For a source that ends, or that never shows enough markers throughout a window. InputError where the last frame
        does not show three markers either.
        """
        while self._quietest is None and self._frames:
            self._measure(LEAST)
            if self._quietest is None:
                self._frames.popleft()
        if self._quietest is None:
            raise InputError("No frame shows three known markers at once, so there is no face to start from.")
        found = self._quietest
        log.warning(
            "The face never held still for %d frames; neutral is the quietest, %d to %d (markers stray %.1f mm)",
            self.window,
            found.first_number,
            found.last_number,
            1000 * self._least_m,
        )
        return found

    def _measure(self, needed: float) -> None:
        """Remember the window if it shows `needed` markers throughout and none before was quieter."""
        world = np.array([frame.positions for frame in self._frames])
        common = np.isfinite(world).all(axis=(0, 2))
        if common.sum() < needed:
            return
        mean, spread = _mean_and_spread(without_rigid_motion(world, common))
        face = float(np.sqrt((spread[common] ** 2).mean()))
        calm = face <= self.face_m and bool(spread[common].max() <= self.marker_m)
        still = calm and len(self._frames) == self.window
        if still or face < self._least_m:
            self._quietest = Neutral(mean, spread, self._frames[0].number, self._frames[-1].number, still)
            self._least_m = face


def without_rigid_motion(world: Array, common: NDArray[np.bool_]) -> Array:
    """(N, M, 3): every frame of `world` laid onto the first by its markers `common` (M,), which all frames show.

    Kabsch 1976, for all frames at once.
    """
    centres = world[:, common].mean(axis=1, keepdims=True)
    U, _, Vt = np.linalg.svd((world[:, common] - centres).swapaxes(1, 2) @ (world[0, common] - centres[0]))
    U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
    laid: Array = (world - centres) @ (U @ Vt) + centres[0]
    return laid


def _mean_and_spread(positions: Array) -> tuple[Array, Array]:
    """Mean (M, 3) over the frames in which each marker is seen, and RMS distance from it (M,); NaN where in none."""
    seen = np.isfinite(positions).all(axis=2, keepdims=True)
    count = np.where(seen.any(axis=0), seen.sum(axis=0), np.nan)
    mean = np.where(seen, positions, 0.0).sum(axis=0) / count
    squares = np.where(seen, positions - mean, 0.0) ** 2
    return mean, np.sqrt(squares.sum(axis=(0, 2)) / count[:, 0])
