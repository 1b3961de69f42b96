"""Where the head is thought to be while too few of its markers are seen: it coasts on, slower and slower.

The velocity is a moving mean over `SMOOTH_S` and dies away over `COAST_S`, so the head comes to rest after about 0.1 s.
Units: metres, seconds, radians; quaternions xyzw, from ``head`` to ``world``. Plain floats: this runs for every frame.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from retarget.markers.rigid import Quat, Vector

SMOOTH_S = 0.05
COAST_S = 0.04
LONGEST_STEP_S = 0.5
"""After a longer silence the old velocity says nothing."""


class HeadMotion:
    """The last pose and a smoothed velocity of it."""

    def __init__(self, time_s: float, quat: Quat, position: Vector) -> None:
        self.time_s = time_s
        self.quat = quat
        self.position = position
        """Of the head's origin, ``world``."""
        self._turning = (0.0, 0.0, 0.0)
        self._moving = (0.0, 0.0, 0.0)

    def saw(self, time_s: float, quat: Quat, position: Vector) -> None:
        """Take in a pose that was measured."""
        step = time_s - self.time_s
        if step > LONGEST_STEP_S:
            self._turning = self._moving = (0.0, 0.0, 0.0)
        elif step > 0:
            share = 1 - math.exp(-step / SMOOTH_S)
            self._turning = _blend(self._turning, small_turn(self.quat, quat), step, share)
            (x, y, z), (px, py, pz) = position, self.position
            self._moving = _blend(self._moving, (x - px, y - py, z - pz), step, share)
        self.time_s, self.quat, self.position = time_s, quat, position

    def expected(self, time_s: float) -> tuple[Quat, Vector] | None:
        """Where the head should be at `time_s`; None after too long a silence."""
        step = time_s - self.time_s
        return self._reached(step) if 0 <= step <= LONGEST_STEP_S else None

    def coast(self, time_s: float) -> None:
        """Let the head go on from its last pose to `time_s`."""
        step = max(time_s - self.time_s, 0.0)
        self.quat, self.position = self._reached(step)
        decay = math.exp(-step / COAST_S)
        self._turning = _scaled(self._turning, decay)
        self._moving = _scaled(self._moving, decay)
        self.time_s = time_s

    def _reached(self, step: float) -> tuple[Quat, Vector]:
        reach = COAST_S * (1 - math.exp(-step / COAST_S))
        tx, ty, tz = _scaled(self._turning, reach)
        angle = math.sqrt(tx * tx + ty * ty + tz * tz)
        share = math.sin(angle / 2) / angle if angle > 0 else 0.5
        quat = turned((tx * share, ty * share, tz * share, math.cos(angle / 2)), self.quat)
        x, y, z = self.position
        mx, my, mz = _scaled(self._moving, reach)
        return quat, (x + mx, y + my, z + mz)


def turned(a: Quat, b: Quat) -> Quat:
    """First the turn `b`, then `a`; `retarget.geometry.quat_multiply` without arrays."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def small_turn(old: Quat, new: Quat) -> Vector:
    """Rotation vector from `old` to `new`, exact as the turn goes to zero."""
    x, y, z, w = turned(new, (-old[0], -old[1], -old[2], old[3]))
    twice = math.copysign(2.0, w)
    return (twice * x, twice * y, twice * z)


def _blend(rate: Vector, change: Vector, step: float, share: float) -> Vector:
    keep, take = 1 - share, share / step
    return (
        rate[0] * keep + change[0] * take,
        rate[1] * keep + change[1] * take,
        rate[2] * keep + change[2] * take,
    )


def _scaled(vector: Vector, factor: float) -> Vector:
    return (vector[0] * factor, vector[1] * factor, vector[2] * factor)
