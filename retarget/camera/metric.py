"""From pixels to metres: landmarks of one picture as points before the camera.

A single camera cannot tell a small face from a far one. So every face is taken to be as large as the canonical one
(outer corners of the eyes 89 mm apart), and its distance follows; expressions are then as large as they would be on
that face, and the calibration's scale takes up the rest. The frame is `camera` in the house's axes, see
`retarget.camera.head_pose`: a face at 0.6 m has z = -0.6.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from retarget.camera import ibug68
from retarget.camera.head_pose import HeadPoseTracker
from retarget.camera.landmarks import IBUG68
from retarget.geometry import apply, umeyama

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.camera.canonical import CanonicalFace
    from retarget.camera.landmarks import Landmarks
    from retarget.frames import MarkerLayout

    Array = NDArray[np.float64]

ROUNDS = 3
"""After which the distance is settled to 1e-6 of itself."""
RIGID68 = (0, 16, 27, 28, 29, 30, 33, 36, 39, 42, 45)
"""Of the 68 landmarks: sides of the head, nose, corners of the eyes."""


class Metres(Protocol):
    """Gives landmarks their place before the camera."""

    def __call__(self, landmarks: Landmarks) -> Array:
        """(M, 3) [m], `camera`; NaN rows where the landmarks are NaN, and throughout where no pose fits them."""

    def reset(self) -> None:
        """The face was lost."""


def metres_for(layout: MarkerLayout, face: CanonicalFace, size: tuple[int, int], focal_px: float | None) -> Metres:
    """What suits the `layout`, for pictures of `size` (width, height) [px]; `focal_px` None is the picture's width."""
    return PosedDepth(face, size, focal_px) if layout is IBUG68 else MeshDepth(face, size, focal_px)


def pixels_of(positions: Array, size: tuple[int, int], focal_px: float | None = None) -> Array:
    """(M, 2) [px] where points (M, 3) [m], `camera`, are in a picture of `size` (width, height) [px]; NaN stays NaN.

    Points behind the camera are NaN; `focal_px` None is the width.
    """
    focal = float(size[0]) if focal_px is None else focal_px
    away = np.where(positions[:, 2:] < 0, -positions[:, 2:], np.nan)
    seen: Array = np.array(size) / 2 + positions[:, :2] * [focal, -focal] / away
    return seen


class MeshDepth:
    """For a mesh with depth of its own, drawn as if from afar: find the distance, then undo the perspective."""

    def __init__(self, face: CanonicalFace, size: tuple[int, int], focal_px: float | None = None) -> None:
        self._rigid = np.flatnonzero(face.weights)
        self._face = face.points[self._rigid]
        self._weights = face.weights[self._rigid]
        self._centre = np.array(size) / 2
        self._focal_px = float(size[0]) if focal_px is None else focal_px

    def reset(self) -> None:
        """Every picture stands for itself."""

    def __call__(self, landmarks: Landmarks) -> Array:
        """(M, 3) [m], `camera`."""
        points = (landmarks.points - [*self._centre, 0.0]) * [1.0, -1.0, -1.0]
        depth = points[:, 2] - np.average(points[self._rigid, 2], weights=self._weights)
        pixels_a_metre = self._scale(points)
        if not np.isfinite(pixels_a_metre):
            return np.full_like(points, np.nan)
        for _ in range(ROUNDS):
            away = (self._focal_px - depth) / pixels_a_metre
            placed = np.column_stack([points[:, :2] * (away / self._focal_px)[:, None], -away])
            pixels_a_metre *= self._scale(placed)
        return placed

    def _scale(self, points: Array) -> float:
        """How much larger than the canonical face the rigid points of `points` (M, 3) are."""
        seen = points[self._rigid]
        if not np.isfinite(seen).all():
            return float("nan")
        return umeyama(self._face, seen, self._weights)[1]


class PosedDepth:
    """For 68 landmarks without depth: that of the canonical face in the head's pose, found by PnP on rigid points."""

    def __init__(self, face: CanonicalFace, size: tuple[int, int], focal_px: float | None = None) -> None:
        self._face = ibug68.from_mesh(face.points)
        self._rigid = list(RIGID68)
        self._centre = np.array(size) / 2
        self._focal_px = float(size[0]) if focal_px is None else focal_px
        self._track = HeadPoseTracker(self._face[self._rigid], size, focal_px)

    def reset(self) -> None:
        """Forget the last pose."""
        self._track.reset()

    def __call__(self, landmarks: Landmarks) -> Array:
        """(M, 3) [m], `camera`."""
        pixels = landmarks.points[:, :2]
        pose = self._track(pixels[self._rigid])
        if pose is None:
            return np.full((len(pixels), 3), np.nan)
        away = -apply(pose.T_camera_head, self._face)[:, 2]
        across = (pixels - self._centre) * [1.0, -1.0] * (away / self._focal_px)[:, None]
        return np.column_stack([across, np.where(np.isnan(across[:, 0]), np.nan, -away)])
