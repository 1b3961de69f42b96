"""A marker that is not seen holds, then eases back to neutral; when it is seen again the difference is eased out.

Nothing jumps: from one frame to the next a shown position moves by no more than its marker did, plus a share of the
distance to go that vanishes with the time between the frames. All times are true time between frames, so the rate of
the frames, lost frames and doubled ones do not matter. Positions are metres, ``head``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from retarget.frames import MarkerFrame

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

NOTHING_M = 1e-7
"""An offset below this is as good as eased out."""


class Filler:
    """A stage: `MarkerFrame` with gaps -> `MarkerFrame` without.

    A marker that has never been seen stands at neutral. Only a marker without a neutral keeps its gaps as NaN: there is
    nothing to measure it against, and the mapping leaves its joint at rest.
    """

    def __init__(self, neutral: Array, hold_s: float = 0.1, ease_s: float = 0.25, return_s: float = 0.08) -> None:
        """`neutral` (M, 3) [m], ``head``, NaN where unknown; `hold_s` [s] before a lost marker leaves its place.

        `ease_s` and `return_s` [s] are the time constants of the way to neutral and of the way back, after each of
        which 37 % of the way is left.
        """
        self._neutral = np.asarray(neutral, float)
        self._known = np.isfinite(self._neutral).all(axis=1)
        self._hold_s, self._ease_s, self._return_s = hold_s, ease_s, return_s
        self.reset()

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._time_s: float | None = None
        self._shown = self._neutral
        self._missing = np.zeros(len(self._neutral), bool)
        self._lost_s = np.zeros(len(self._neutral))
        self._offset: Array | None = None
        """(M, 3) shown less measured, while that is eased out; None where it is zero throughout."""
        self.filled = 0
        """Positions filled so far."""

    def __call__(self, frame: MarkerFrame) -> MarkerFrame:
        """`frame` with every gap filled."""
        step = 0.0 if self._time_s is None else max(frame.time_s - self._time_s, 0.0)
        self._time_s = frame.time_s
        missing = self._known & ~np.isfinite(frame.positions).all(axis=1)
        if self._offset is None and not missing.any() and not self._missing.any():
            self._shown = frame.positions
            return frame
        self._offset = self._offset_now(frame.positions, missing, step)
        measured = frame.positions if self._offset is None else frame.positions + self._offset
        self._shown = np.where(missing[:, None], self._held(missing, step), measured)
        self._missing = missing
        self.filled += int(missing.sum())
        return MarkerFrame(
            frame.number,
            frame.time_s,
            frame.received_s,
            frame.layout,
            self._shown,
            frame.T_world_head,
            frame.unlabelled,
        )

    def _held(self, missing: NDArray[np.bool_], step: float) -> Array:
        """(M, 3) where a marker that is not seen stands now."""
        self._lost_s = np.where(missing, self._lost_s + step, 0.0)
        easing_s = np.clip(self._lost_s - self._hold_s, 0.0, step)
        share = 1.0 - np.exp(-easing_s / self._ease_s)
        held: Array = self._shown + share[:, None] * (self._neutral - self._shown)
        return held

    def _offset_now(self, positions: Array, missing: NDArray[np.bool_], step: float) -> Array | None:
        """(M, 3) what is still to be eased out of the markers seen, those that have just come back among them."""
        back = self._missing & ~missing
        offset = np.zeros_like(positions) if self._offset is None else self._offset
        offset = np.where(back[:, None], self._shown - positions, offset)
        offset *= math.exp(-step / self._return_s)
        offset[missing | ~self._known] = 0.0
        return offset if np.abs(offset).max(initial=0.0) > NOTHING_M else None
