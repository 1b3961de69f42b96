"""How open the eyes are, how wide the mouth: numbers read off landmarks, free of the picture's scale.

`openvhead_measures` is OpenVHead's own set on the 68 landmarks of iBUG, to the last constant, so that programs tuned to
its numbers keep working (OpenVHead, T. Wu, MIT, commit 4c84abcc). `mesh_measures` reads more off a face mesh, irises
among it. Both divide lengths by a length of the same face, whatever unit the landmarks come in. The mesh's distances
are taken in space, so they stay when the head turns; left and right are the performer's.
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


class MeshMeasures(NamedTuple):
    """What a face mesh tells; what is at rest differs from face to face, so compare with the performer's neutral."""

    eye_left: float
    """Gap of the lids over the width of the eye: shut below 0.15, open about 0.35."""
    eye_right: float
    gaze_across: float
    """Where both irises stand between the corners of the eyes: -1 to the performer's right, 0 middle, 1 to his left."""
    gaze_up: float
    """How far the irises stand above the line through the corners, in half widths of the eye."""
    brow_left: float
    """Height of the brow above the eye, over the distance of the eyes' outer corners."""
    brow_right: float
    smile: float
    """How far the corners of the mouth stand above the middle of the lips, over the same."""
    mouth_width: float
    """Between the corners, over the same."""
    mouth_open: float
    """Gap of the inner lips, over the same."""
    jaw_open: float
    """From the nose's base to the chin, over the same."""


class _Eye(NamedTuple):
    outer: int
    inner: int
    upper: tuple[int, int, int]
    lower: tuple[int, int, int]
    iris: int
    brow: tuple[int, int, int]


_EYE_RIGHT = _Eye(33, 133, (160, 159, 158), (144, 145, 153), 468, (63, 105, 66))
_EYE_LEFT = _Eye(263, 362, (387, 386, 385), (373, 374, 380), 473, (293, 334, 296))
_MOUTH_CORNERS, _LIPS_INSIDE, _LIPS_OUTSIDE = (61, 291), (13, 14), (0, 17)
_NOSE_BASE, _CHIN = 2, 152


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


def mesh_measures(points: Array) -> MeshMeasures:
    """The numbers of a face mesh, `points` (478, 3) in the house's axes, any unit; NaN where a point they need is.

    Positions in metres before the camera do (`retarget.camera.metric`).
    """
    points = np.asarray(points, float)
    width = _distance(points, _EYE_RIGHT.outer, _EYE_LEFT.outer)
    across = (points[_EYE_LEFT.outer] - points[_EYE_RIGHT.outer]) / width
    chin_to_eyes = points[[_EYE_RIGHT.outer, _EYE_LEFT.outer]].mean(axis=0) - points[_CHIN]
    up = chin_to_eyes - (chin_to_eyes @ across) * across
    up /= np.linalg.norm(up)
    gazes = np.array([_gaze(points, eye, across, up) for eye in (_EYE_RIGHT, _EYE_LEFT)]).mean(axis=0)
    corners = points[list(_MOUTH_CORNERS)].mean(axis=0) - points[list(_LIPS_OUTSIDE)].mean(axis=0)
    return MeshMeasures(
        eye_left=_openness(points, _EYE_LEFT),
        eye_right=_openness(points, _EYE_RIGHT),
        gaze_across=float(gazes[0]),
        gaze_up=float(gazes[1]),
        brow_left=_brow(points, _EYE_LEFT, up) / width,
        brow_right=_brow(points, _EYE_RIGHT, up) / width,
        smile=float(corners @ up) / width,
        mouth_width=_distance(points, *_MOUTH_CORNERS) / width,
        mouth_open=_distance(points, *_LIPS_INSIDE) / width,
        jaw_open=_distance(points, _NOSE_BASE, _CHIN) / width,
    )


def _openness(points: Array, eye: _Eye) -> float:
    gaps = np.linalg.norm(points[list(eye.upper)] - points[list(eye.lower)], axis=1)
    return float(gaps.mean()) / _distance(points, eye.outer, eye.inner)


def _gaze(points: Array, eye: _Eye, across: Array, up: Array) -> tuple[float, float]:
    """Across and up, of the iris from the middle of the corners, in half widths of the eye."""
    offset = points[eye.iris] - points[[eye.outer, eye.inner]].mean(axis=0)
    half = _distance(points, eye.outer, eye.inner) / 2
    return float(offset @ across) / half, float(offset @ up) / half


def _brow(points: Array, eye: _Eye, up: Array) -> float:
    return float((points[list(eye.brow)].mean(axis=0) - points[[eye.outer, eye.inner]].mean(axis=0)) @ up)


def _eye(points: Array, lids: tuple[tuple[int, int], ...], reference: float) -> float:
    gaps = [_distance(points, upper, lower) for upper, lower in lids]
    return 6 * (sum(gaps) / (2 * reference) - 0.02)


def _distance(points: Array, a: int, b: int) -> float:
    return float(np.linalg.norm(points[a] - points[b]))
