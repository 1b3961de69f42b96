"""OpenVHead's chain of filters and formulas, for programs that expect its very numbers.

The sending half: landmarks -> measures (raw) and pose (of landmarks through a Kalman filter, a cast to int32 and a mean
of five). The receiving half, which runs once per drawn picture: position, Kalman filter per quaternion component and
the turn for its second model. Kept with its flaws, which tests show: filters start at zero, the quaternion's sign flips
and whole pixels are lost; `camera.head_pose` has none of them. Rotations are in OpenCV's axes, w first.
Source: OpenVHead (T. Wu, MIT), commit 4c84abcc, visual_measurement.py and ParameterServer.cs.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np

from retarget.camera import ibug68
from retarget.camera.head_pose import openvhead_pose, openvhead_quaternion
from retarget.camera.measures import OpenVHeadMeasures, openvhead_measures

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MEAN_OF = 5
"""Frames of the mean; two frames of lag."""
PROCESS_NOISE, MEASUREMENT_NOISE = 1.0, 10.0
QUATERNION_PROCESS_NOISE, QUATERNION_MEASUREMENT_NOISE, QUATERNION_VARIANCE = 8e-3, 5e-4, 0.1
DECIMALS = 4
"""To which the quaternion is rounded."""
UNITS_PER_METRE = 1000.0
"""By which the receiver divides the translation."""
SECOND_MODEL_HALF_TURN = 1.6
"""Radians."""


@dataclass(frozen=True, slots=True, eq=False)
class OpenVHeadValues:
    """What OpenVHead tells of one picture."""

    translation: Array
    """(3,) in the unit of the six-point model, OpenCV's axes."""
    quat_wxyz: Array
    """(4,) rounded to four decimals."""
    measures: OpenVHeadMeasures

    def fields(self) -> tuple[float, ...]:
        """The eleven numbers in the order of its message."""
        return (*self.translation.tolist(), *self.quat_wxyz.tolist(), *self.measures)


class LandmarkSmoother:
    """Kalman filter, cast to whole pixels, mean of the last five.

    OpenVHead inverts 68x68 matrices for it, but all are multiples of the identity: every coordinate has the same gain,
    which tends to 0.27.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Start from zeros again, as OpenVHead does."""
        self._state = np.zeros((ibug68.COUNT, 2))
        self._variance = 1.0
        self._last = deque([np.zeros((ibug68.COUNT, 2), np.int32)] * MEAN_OF, maxlen=MEAN_OF)

    def __call__(self, points: Array) -> Array:
        """(68, 2) [px] smoothed, of `points` (68, 2) [px], all finite."""
        self._variance += PROCESS_NOISE
        gain = self._variance / (self._variance + MEASUREMENT_NOISE)
        self._state = self._state + gain * (points - self._state)
        self._variance *= 1.0 - gain
        self._last.append(self._state.astype(np.int32))
        mean: Array = np.mean(self._last, axis=0)
        return mean


class OpenVHeadChain:
    """From the 68 landmarks of each picture to OpenVHead's numbers. Give it only pictures that show a face."""

    def __init__(self, size: tuple[int, int]) -> None:
        """Pictures of `size` (width, height) [px]."""
        self._size = size
        self._smooth = LandmarkSmoother()

    def reset(self) -> None:
        """Forget all pictures."""
        self._smooth.reset()

    def __call__(self, points: Array) -> OpenVHeadValues:
        """The numbers for `points` (68, 2), which its detector gives in whole pixels."""
        turn, place = openvhead_pose(self._smooth(points), self._size)
        quat = np.round(openvhead_quaternion(turn), DECIMALS)
        return OpenVHeadValues(place, quat, openvhead_measures(points))


class QuaternionKalman:
    """The receiver's filter: one scalar Kalman filter per component, started at zero, never renormalised.

    Its gain tends to 0.944, so a flip of the sign goes almost through at once, and through zero.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Start from zeros again, as OpenVHead does."""
        self._state = np.zeros(4)
        self._variance = QUATERNION_VARIANCE

    def __call__(self, quat: Array) -> Array:
        """(4,) filtered, not of unit length, of `quat` (4,), in the same order."""
        gain = self._variance / (self._variance + QUATERNION_MEASUREMENT_NOISE)
        self._state = self._state + gain * (quat - self._state)
        self._variance += QUATERNION_PROCESS_NOISE - gain * self._variance
        return self._state


def receiver_position(translation: Array) -> Array:
    """(3,) where the receiver puts the head, in Unity's units."""
    return -np.asarray(translation, float) / UNITS_PER_METRE


def second_model_rotation(quat_wxyz: Array) -> Array:
    """(4,) w, x, y, z with which the receiver turns its second model: 3.2 rad about x, then y and z negated."""
    w, x, y, z = quat_wxyz
    c, s = cos(SECOND_MODEL_HALF_TURN), sin(SECOND_MODEL_HALF_TURN)
    return np.array([c * w - s * x, c * x + s * w, s * z - c * y, -(c * z + s * y)])
