"""Where the head is, from landmarks of one picture: the perspective-n-point problem.

Two ways. `openvhead_pose` answers as OpenVHead does: its six points, its model, its solver. `HeadPoseTracker` takes any
rigid points of a face whose shape is known, starts with SQPnP (Terzakis and Lourakis 2020) and then refines from the
previous picture's pose, so that it neither jumps between solutions nor flips the sign of the quaternion.

OpenCV's camera looks along +Z with +Y down; the camera of this package is turned into the house's axes: +X to the
picture's right (the performer's left), +Y up, +Z from the scene to the viewer, origin in the lens. A camera without
calibration is taken to have square pixels, its centre in the middle and `focal_px` equal to the picture's width.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

CV_TO_HOUSE = np.diag([1.0, -1.0, -1.0])
"""R of the same camera in the house's axes: half a turn about X."""

OPENVHEAD_POINTS = (30, 8, 36, 45, 1, 15)
"""Landmarks of the 68: tip of the nose, chin, outer corners of the eyes, sides of the head."""
OPENVHEAD_MODEL: Array = np.array(
    [
        [0.0, 0.0, 0.0],
        [0.0, -330.0, -65.0],
        [-225.0, 170.0, -135.0],
        [225.0, 170.0, -135.0],
        [-349.0, 85.0, -300.0],
        [349.0, 85.0, -300.0],
    ]
)
"""(6, 3) the same in the model's arbitrary unit of about 0.1 mm, +Y up, +Z out of the face."""
LEAST_POINTS = 4
"""Points that a pose needs."""
DOUBTFUL = 0.05
"""Error over the size of the face in the picture from which a followed pose is searched anew: the head has jumped."""


@dataclass(frozen=True, slots=True, eq=False)
class HeadPose:
    """A head before a camera."""

    T_camera_head: Array
    """(4, 4), house's axes; its length unit is that of the model."""
    quat_xyzw: Array
    """(4,) the turn of `T_camera_head`, on the same hemisphere as that of the picture before."""
    error_px: float
    """Root mean square distance between the points seen and those of the posed model."""


def camera_matrix(size: tuple[int, int], focal_px: float | None = None) -> Array:
    """(3, 3) of a pinhole camera for pictures of `size` (width, height) [px]; the focal length is the width if None."""
    width, height = size
    focal = float(width) if focal_px is None else focal_px
    return np.array([[focal, 0.0, width / 2], [0.0, focal, height / 2], [0.0, 0.0, 1.0]])


def openvhead_pose(points: Array, size: tuple[int, int]) -> tuple[Array, Array]:
    """Rotation vector (3,) and translation (3,) of OpenVHead's model for 68 `points` (68, 2) [px].

    In OpenCV's axes and the model's unit, as OpenVHead sends them. Its flag SOLVEPNP_DLS has meant EPnP ever since
    OpenCV 4.0, and is gone from OpenCV 5; so EPnP it is. NaN throughout where it finds no pose.
    """
    import cv2

    seen = np.ascontiguousarray(points[list(OPENVHEAD_POINTS)], float)
    none = np.full(3, np.nan)
    if not np.isfinite(seen).all():
        return none, none
    found, turn, place = cv2.solvePnP(
        OPENVHEAD_MODEL, seen, camera_matrix(size), np.zeros((4, 1)), flags=cv2.SOLVEPNP_EPNP
    )
    return (np.asarray(turn, float)[:, 0], np.asarray(place, float)[:, 0]) if found else (none, none)


def openvhead_quaternion(turn: Array) -> Array:
    """(4,) w, x, y, z of a rotation vector `turn` (3,), unaligned as OpenVHead has it; NaN for no turn at all."""
    angle = float(np.linalg.norm(turn))
    with np.errstate(invalid="ignore"):
        axis = turn / angle if angle else np.full(3, np.nan)
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis])


class HeadPoseTracker:
    """Poses of one head, picture after picture; `reset` when the face was lost."""

    def __init__(self, model: Array, size: tuple[int, int], focal_px: float | None = None) -> None:
        """`model` (N, 3) rigid points in ``head``, any unit; pictures of `size` (width, height) [px]."""
        self._model = np.ascontiguousarray(model, float)
        self._camera = camera_matrix(size, focal_px)
        self.reset()

    def reset(self) -> None:
        """Start the next search from nothing."""
        self._last: tuple[Array, Array] | None = None
        self._quat: Array | None = None

    def __call__(self, points: Array) -> HeadPose | None:
        """The pose for `points` (N, 2) [px] of the model, NaN rows unseen; None if fewer than four are seen, or if no
        pose puts the head before the camera.
        """
        seen = np.isfinite(points).all(axis=1)
        if seen.sum() < LEAST_POINTS:
            self.reset()
            return None
        model, pixels = self._model[seen], np.ascontiguousarray(points[seen], float)
        pose = self._best(model, pixels)
        if pose is None:
            self.reset()
        return pose

    def _best(self, model: Array, pixels: Array) -> HeadPose | None:
        """Followed from the last pose where that fits, else from a search without any guess."""
        followed = self._refined(model, pixels, self._last) if self._last is not None else None
        doubtful_px = DOUBTFUL * float(np.ptp(pixels, axis=0).max())
        if followed is None or followed[2] > doubtful_px:
            searched = self._refined(model, pixels, None)
            found = [each for each in (followed, searched) if each is not None]
            if not found:
                return None
            followed = min(found, key=lambda each: each[2])
        turn, place, error_px = followed
        self._last = turn, place
        return self._pose(turn, place, error_px)

    def _refined(
        self, model: Array, pixels: Array, start: tuple[Array, Array] | None
    ) -> tuple[Array, Array, float] | None:
        """Rotation vector and translation, (3, 1) each, and the error [px], by least squares from `start`."""
        import cv2

        try:
            turn, place = _searched(model, pixels, self._camera) if start is None else start
            found, turn, place = cv2.solvePnP(  # type: ignore[assignment]
                model, pixels, self._camera, None, turn.copy(), place.copy(), True, cv2.SOLVEPNP_ITERATIVE
            )
            shown, _ = cv2.projectPoints(model, turn, place, self._camera, None)
        except cv2.error:  # points on one line, or all at one place
            return None
        error_px = float(np.sqrt(((shown[:, 0] - pixels) ** 2).sum(axis=1).mean()))
        in_front = place[2, 0] > 0 and np.isfinite(error_px)
        return (np.asarray(turn, float), np.asarray(place, float), error_px) if found and in_front else None

    def _pose(self, turn: Array, place: Array, error_px: float) -> HeadPose:
        import cv2

        rotation, _ = cv2.Rodrigues(turn)
        T_camera_head = geometry.transform(CV_TO_HOUSE @ rotation, CV_TO_HOUSE @ place[:, 0])
        quat = geometry.quat_from_matrix(T_camera_head[:3, :3])
        self._quat = quat if self._quat is None else geometry.align_hemisphere(quat, self._quat)
        return HeadPose(T_camera_head, self._quat, error_px)


def _searched(model: Array, pixels: Array, camera: Array) -> tuple[Array, Array]:
    """Rotation vector and translation, (3, 1) each, without any guess."""
    import cv2

    _, turn, place = cv2.solvePnP(model, pixels, camera, None, flags=cv2.SOLVEPNP_SQPNP)
    return np.asarray(turn, float), np.asarray(place, float)
