"""A mass that a PD controller drives to its target: the smoother of OpenVHead, as it is and in true time.

With the error e = target - x, one update of T simulated seconds is

    p = kp e,  d = (1 - alpha) kd (e - e_1) / T + alpha d_1,  v += T (p + d) / mass,  x += T v,  x < floor -> floor

(an incomplete derivative: alpha filters it). OpenVHead takes T = 0.1 for every update of its display, however long
that took. In true time the same recurrence is carried on between its updates: one update is a linear map of the state
(x - target, v, q), q = alpha d_1 - (1 - alpha) kd e_1 / T, and its power `rate_hz` dt is the map of the time dt. At
dt = 1 / rate_hz it is OpenVHead's update, two half steps are a whole one, and no step is too long.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError
from retarget.filters.filter import Clock

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]
    Mask = NDArray[np.bool_]

UPDATE_S = 0.1
"""Simulated seconds of one update."""
RATE_HZ = 60.0
"""Updates a second for which true time matches: a display at 60 Hz."""
WORST_CONDITION = 1e7
"""Of the modes of the motion; beyond it two of them are one to rounding."""


@dataclass(frozen=True, slots=True)
class PdGains:
    """The controller and its mass. InputError unless the plain PD control is overdamped: kd^2 > 4 mass kp."""

    kp: float = 0.04
    kd: float = 1.0
    mass: float = 1.0
    alpha: float = 0.7
    """How much of the derivative stays from one update to the next, 0 <= alpha < 1."""

    def __post_init__(self) -> None:
        if not (self.kp > 0 and self.mass > 0 and 0 <= self.alpha < 1):
            raise InputError(
                "A PD controlled mass needs kp and mass above 0 and an alpha from 0 to below 1; these are "
                f"{self.kp:g}, {self.mass:g} and {self.alpha:g}."
            )
        if not self.kd**2 > 4 * self.mass * self.kp or self.kd < 0:
            raise InputError(
                f"A mass of {self.mass:g} with kp {self.kp:g} and kd {self.kd:g} swings about its target: choose kd "
                f"above {2 * (self.mass * self.kp) ** 0.5:.3g}, as kd^2 > 4 mass kp asks."
            )


class SteppedPdMass:
    """A `Filter`: OpenVHead's recurrence, one update a call, whatever the time; NaN leaves a mass alone."""

    def __init__(self, gains: PdGains, start: ArrayLike, floor: float = 0.0) -> None:
        """N masses at rest at `start` (N,); none goes below `floor`."""
        self._gains, self._floor = gains, floor
        self._start = np.asarray(start, float)
        self.reset()

    def reset(self) -> None:
        """As `Filter`."""
        self._x = self._start.copy()
        self._v, self._e, self._d = (np.zeros(len(self._x)) for _ in range(3))

    def __call__(self, values: Array, _time_s: float) -> Array:
        """As `Filter`, but that every call is an update."""
        g, called = self._gains, np.isfinite(values)
        e = values - self._x
        d = (1 - g.alpha) * g.kd * (e - self._e) / UPDATE_S + g.alpha * self._d
        v = self._v + (g.kp * e + d) / g.mass * UPDATE_S
        x = np.maximum(self._x + v * UPDATE_S, self._floor)
        self._x, self._v = np.where(called, x, self._x), np.where(called, v, self._v)
        self._e, self._d = np.where(called, e, self._e), np.where(called, d, self._d)
        return self._x.copy()

    def put(self, where: Mask, value: float) -> None:
        """The masses `where` (N,) are at `value`; all else of their state stays, as in OpenVHead."""
        self._x[where] = value

    def rest(self, where: Mask, value: float) -> None:
        """The masses `where` (N,) rest at `value`."""
        self._x[where] = value
        self._v[where] = self._e[where] = self._d[where] = 0.0


class PdMass:
    """A `Filter`: the same masses in true time, starting at rest where each signal is first seen."""

    def __init__(self, gains: PdGains, floor: ArrayLike = -np.inf, rate_hz: float = RATE_HZ) -> None:
        """No mass goes below `floor`, one for all or (N,); there it stops. At `rate_hz` a call is OpenVHead's update.

        InputError where the gains are too stiff for the update, so that it does not settle.
        """
        self._floor, self._rate_hz = np.asarray(floor, float), rate_hz
        self._factors, self._modes = _modes(_update(gains))
        self._to_modes = np.linalg.inv(self._modes)
        self._clock = Clock()
        self.reset()

    def reset(self) -> None:
        """As `Filter`."""
        self._clock.reset()
        self._state = np.zeros((0, 3))
        """(N, 3): place, speed, and what the derivative still holds."""

    def __call__(self, values: Array, time_s: float) -> Array:
        """As `Filter`."""
        steps = self._clock.steps(values, time_s)
        if len(self._state) != len(values):
            self._state = np.full((len(values), 3), np.nan)
        first, new = np.isinf(steps), np.isfinite(steps)
        self._settle(first, values)
        target = np.zeros((len(values), 3))
        target[:, 0] = values
        moved = ((self._state - target) @ self._to_modes.T * self._powers(steps) @ self._modes.T).real + target
        self._state = np.where(new[:, None], self._stopped(moved), self._state)
        return self._state[:, 0].copy()

    def _powers(self, steps: Array) -> Array:
        """(N, 3) by how much each mode shrinks in `steps` (N,) [s]; nearly always these are one number."""
        different, which = np.unique(np.where(np.isfinite(steps), steps, 0.0), return_inverse=True)
        powers: Array = (self._factors ** (self._rate_hz * different)[:, None])[which]
        return powers

    def rest(self, where: Mask, value: float) -> None:
        """The masses `where` (N,) rest at `value`."""
        self._clock.see(where)
        self._settle(where, np.full(len(self._state), value))

    def _settle(self, where: Mask, values: Array) -> None:
        self._state[where] = 0.0
        self._state[where, 0] = values[where]

    def _stopped(self, state: Array) -> Array:
        below = state[:, 0] < self._floor
        if below.any():
            state[:, 0] = np.where(below, self._floor, state[:, 0])
            state[:, 1] = np.where(below, np.maximum(state[:, 1], 0.0), state[:, 1])
        return state


def _update(gains: PdGains) -> Array:
    """(3, 3): one update as a map of (x - target, v, q)."""
    T, mass = UPDATE_S, gains.mass
    kick = (1 - gains.alpha) * gains.kd / T  # of the derivative, for a unit of error
    force = np.array([-(gains.kp + kick), 0.0, 1.0])  # p + d, d = kick e + q
    v = np.array([0.0, 1.0, 0.0]) + T / mass * force
    x = np.array([1.0, 0.0, 0.0]) + T * v
    q = np.array([kick * (1 - gains.alpha), 0.0, gains.alpha])
    return np.stack([x, v, q])


def _modes(update: Array) -> tuple[Array, Array]:
    """The factors (3,) by which the modes of the motion shrink in one update, and the modes (3, 3), complex."""
    factors, modes = np.linalg.eig(update.astype(complex))
    swings = (np.abs(factors.imag) < 1e-12) & (factors.real < -1e-12)
    if np.abs(factors).max() >= 1 or swings.any():
        raise InputError(
            "These gains of a PD controlled mass are too stiff for its update of 0.1 s: lower kd or raise the mass."
        )
    if np.linalg.cond(modes) > WORST_CONDITION:
        raise InputError("These gains of a PD controlled mass make two of its modes one: change alpha a little.")
    return factors, modes
