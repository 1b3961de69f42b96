"""The blink trick of OpenVHead: an eye that is nearly shut is shut at once, however slow its smoother is.

The signal is an openness. Below the threshold the value is forced to a floor and the smoother is not asked. OpenVHead
leaves the smoother's speed, error and derivative as they were before the blink ("stale"), so that the eye starts to
open with the speed it shut with; here the smoother rests at the floor ("rest"), and the eye opens from there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from retarget.errors import InputError
from retarget.filters.pd_mass import SteppedPdMass

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.filters.pd_mass import PdMass

    Array = NDArray[np.float64]

FLOOR = 0.01


class BlinkTrick:
    """A `Filter` around a PD controlled mass."""

    def __init__(
        self,
        smoother: PdMass | SteppedPdMass,
        threshold: float | Array,
        floor: float = FLOOR,
        after: Literal["rest", "stale"] = "rest",
    ) -> None:
        """`threshold`, one for all or (N,): -inf for a signal that is no eye. InputError for "stale" in true time."""
        self._smoother, self._threshold, self._floor = smoother, threshold, floor
        if after == "stale" and not isinstance(smoother, SteppedPdMass):
            raise InputError("A stale state after a blink belongs to the compatible PD mass, which has no true time.")
        self._put = smoother.put if after == "stale" and isinstance(smoother, SteppedPdMass) else smoother.rest

    def reset(self) -> None:
        """As `Filter`."""
        self._smoother.reset()

    def __call__(self, values: Array, time_s: float) -> Array:
        """As `Filter`."""
        shut = values < self._threshold
        smooth = self._smoother(np.where(shut, np.nan, values), time_s)
        if not shut.any():
            return smooth
        self._put(shut, self._floor)
        return np.where(shut, self._floor, smooth)
