"""Kalman filters of independent signals: a value that wanders, and a value with a speed that wanders.

Variances have the square of the signal's unit. R. E. Kalman, "A new approach to linear filtering and prediction
problems", 1960. Where every matrix is a multiple of the identity, a filter of many landmarks is this one on each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from retarget.errors import InputError
from retarget.filters.filter import Clock

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

UNKNOWN = 1e12
"""Variance, in those of the noise, of what nothing is known of."""


class Kalman:
    """A `Filter` of values that wander: x' = x + w, z = x + n.

    From one sample to the next the variance grows by `process`: for every second, or, as `per` = "sample" has it, once.
    """

    def __init__(
        self,
        process: float,
        noise: float,
        *,
        per: Literal["second", "sample"] = "second",
        start: ArrayLike | None = None,
        start_variance: float = 1.0,
    ) -> None:
        """`start`, of variance `start_variance`, is what is known at the first sample; by default nothing is.

        InputError for variances that are not above 0.
        """
        _check_variances(process, noise)
        self._process, self._noise, self._per = process, noise, per
        self._start = None if start is None else np.asarray(start, float)
        self._start_variance = start_variance
        self._clock = Clock()
        self.reset()

    def reset(self) -> None:
        """As `Filter`."""
        self._clock.reset()
        self._value = np.zeros(0)
        self._variance = np.zeros(0)

    def __call__(self, values: Array, time_s: float) -> Array:
        """As `Filter`; a signal not seen yet is at its `start`, if there is one."""
        steps = self._clock.steps(values, time_s)
        new, first = ~np.isnan(steps), np.isinf(steps)
        if len(self._value) != len(values):
            self._value = np.full(len(values), np.nan if self._start is None else self._start)
            self._variance = np.full(len(values), self._start_variance)
        if self._start is None:
            self._value[first], self._variance[first] = values[first], UNKNOWN * self._noise
        elapsed = np.where(first | ~new, 0.0, 1.0 if self._per == "sample" else steps)
        variance = self._variance + elapsed * self._process
        gain = variance / (variance + self._noise)
        self._value = np.where(new, self._value + gain * (values - self._value), self._value)
        self._variance = np.where(new, (1 - gain) * variance, self._variance)
        return self._value.copy()


class VelocityKalman:
    """A `Filter` of values with a speed that wanders: white acceleration of density `process` [signal^2 / s^3]."""

    def __init__(self, process: float, noise: float, start_speed: float = 1.0) -> None:
        """`start_speed` [signal / s] is how fast a signal may be when it is first seen.

        InputError for variances that are not above 0.
        """
        _check_variances(process, noise)
        self._process, self._noise, self._start_speed = process, noise, start_speed
        self._clock = Clock()
        self.reset()

    def reset(self) -> None:
        """As `Filter`."""
        self._clock.reset()
        self._state = np.zeros((5, 0))
        """Rows: value, speed, and the variances of the value, of both together, of the speed."""

    def __call__(self, values: Array, time_s: float) -> Array:
        """As `Filter`."""
        steps = self._clock.steps(values, time_s)
        if self._state.shape[1] != len(values):
            self._state = np.full((5, len(values)), np.nan)
        first, new = np.isinf(steps), np.isfinite(steps)
        state = self._corrected(self._predicted(np.where(new, steps, 0.0)), values)
        self._state = np.where(new, state, self._state)
        self._state[0, first] = values[first]
        self._state[1:, first] = np.array([[0.0], [self._noise], [0.0], [self._start_speed**2]])
        value: Array = self._state[0].copy()
        return value

    def _predicted(self, dt: Array) -> Array:
        x, v, xx, xv, vv = self._state
        q = self._process
        return np.array(
            [
                x + dt * v,
                v,
                xx + dt * (2 * xv + dt * vv) + q * dt**3 / 3,
                xv + dt * vv + q * dt**2 / 2,
                vv + q * dt,
            ]
        )

    def _corrected(self, state: Array, values: Array) -> Array:
        x, v, xx, xv, vv = state
        gain_x, gain_v = xx / (xx + self._noise), xv / (xx + self._noise)
        off = values - x
        return np.array([x + gain_x * off, v + gain_v * off, (1 - gain_x) * xx, (1 - gain_x) * xv, vv - gain_v * xv])


def _check_variances(process: float, noise: float) -> None:
    if not (process > 0 and noise > 0):
        raise InputError(f"A Kalman filter needs variances above 0; these are {process:g} and {noise:g}.")
