"""How open the eyes are, how wide the mouth: numbers read off landmarks, free of the picture's scale.

`openvhead_measures` is OpenVHead's own set on the 68 landmarks of iBUG, to the last constant, so that programs tuned to
its numbers keep working. Lengths are divided by a reference length of the face, whatever unit the landmarks come in.
Source: OpenVHead (T. Wu, MIT), commit 4c84abcc.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from retarget.camera import ibug68

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


class OpenVHeadMeasures(NamedTuple):
    """What OpenVHead measures; a closed eye is near 0, an open one 0.2 to 0.3."""

    left_eye: float
    """Openness of the eye on the picture's left: the performer's right one, if the camera does not mirror."""
    right_eye: float
    mouth_width: float
    """How far the lips are apart, although it is called a width; slightly negative for some closed mouths."""
    mouth_length: float
    """Between the corners of the mouth."""


def reference_length(points: Array) -> float:
    """Mean of the face's height (27 to 8) and width (0 to 16) of 68 `points` (68, 2 or 3), in their unit."""
    height = _distance(points, ibug68.NOSE_ROOT, ibug68.CHIN)
    return (height + _distance(points, ibug68.JAW_RIGHT, ibug68.JAW_LEFT)) / 2


def openvhead_measures(points: Array) -> OpenVHeadMeasures:
    """OpenVHead's four numbers of 68 `points` (68, 2 or 3) in any unit; NaN where a point they need is NaN."""
    points = np.asarray(points, float)
    reference = reference_length(points)
    return OpenVHeadMeasures(
        left_eye=_eye(points, ((37, 41), (38, 40)), reference),
        right_eye=_eye(points, ((43, 47), (44, 46)), reference),
        mouth_width=1.27 * (_distance(points, 51, 57) / reference - 0.13) + 0.02,
        mouth_length=_distance(points, 60, 64) / reference,
    )


def _eye(points: Array, lids: tuple[tuple[int, int], ...], reference: float) -> float:
    gaps = [_distance(points, upper, lower) for upper, lower in lids]
    return 6 * (sum(gaps) / (2 * reference) - 0.02)


def _distance(points: Array, a: int, b: int) -> float:
    return float(np.linalg.norm(points[a] - points[b]))
