"""The One-Euro filter: a low pass whose cut-off rises with the speed of the signal.

Slow signals lose their jitter, fast ones keep their timing. G. Casiez, N. Roussel, D. Vogel, "1 Euro filter: a simple
speed-based low-pass filter for noisy input in interactive systems", CHI 2012.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError
from retarget.filters.filter import Clock

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

SPEED_CUTOFF_HZ = 1.0


class OneEuro:
    """A `Filter`: cut-off = `min_cutoff_hz` + `beta` |speed|.

    `beta` has the unit of 1 / signal: bring signals to a range of about 1, or divide it by their range.
    """

    def __init__(self, min_cutoff_hz: float = 1.0, beta: float = 4.0, speed_cutoff_hz: float = SPEED_CUTOFF_HZ) -> None:
        """InputError where a cut-off is not above 0, or `beta` is below 0."""
        if not (min_cutoff_hz > 0 and speed_cutoff_hz > 0 and beta >= 0):
            raise InputError(
                f"A One-Euro filter needs cut-offs above 0 Hz and a beta of 0 or more; these are {min_cutoff_hz:g} Hz, "
                f"{speed_cutoff_hz:g} Hz and {beta:g}."
            )
        self._min_cutoff_hz, self._beta, self._speed_cutoff_hz = min_cutoff_hz, beta, speed_cutoff_hz
        self._clock = Clock()
        self.reset()

    def reset(self) -> None:
        """As `Filter`."""
        self._clock.reset()
        self._value: Array | None = None
        self._speed: Array | None = None

    def __call__(self, values: Array, time_s: float) -> Array:
        """As `Filter`."""
        steps = self._clock.steps(values, time_s)
        if self._value is None or self._speed is None:
            self._value, self._speed = values.copy(), np.zeros(len(values))
            return self._value.copy()
        first, new = np.isinf(steps), np.isfinite(steps)
        steps = np.where(new, steps, 1.0)
        before = np.where(new, self._value, 0.0)
        value = np.where(new, values, 0.0)
        speed = self._speed + low_pass_gain(self._speed_cutoff_hz, steps) * ((value - before) / steps - self._speed)
        gain = low_pass_gain(self._min_cutoff_hz + self._beta * np.abs(speed), steps)
        self._speed = np.where(new, speed, self._speed)
        self._value = np.where(new, before + gain * (value - before), np.where(first, values, self._value))
        return self._value.copy()


def low_pass_gain(cutoff_hz: Array | float, dt_s: Array) -> Array:
    """How far a first-order low pass goes to its input in `dt_s` by an implicit step: 1 / (1 + 1 / (2 pi fc dt))."""
    turns = 2 * math.pi * cutoff_hz * dt_s
    gain: Array = turns / (1 + turns)
    return gain
