"""MediaPipe's face mesh, run by OpenCV: a detector where the face is new, then the mesh follows itself.

Two nets: 478 points with irises, or 468 without, which is three times as fast. Kartynnik et al. 2019, "Real-time Facial
Surface Geometry from Monocular Video on Mobile GPUs", arXiv 1907.06724.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from retarget.camera import ibug68
from retarget.camera.face_detector import FaceDetector
from retarget.camera.landmarks import IBUG68, MESH478, Landmarks
from retarget.camera.models import model_path
from retarget.camera.net import Net, picture_blob, sigmoid
from retarget.camera.region import Region

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerLayout

    Array = NDArray[np.float64]

LEAST_SCORE = 0.5
EYE_RIGHT, EYE_LEFT = 33, 263
"""Outer corners, from which the next picture's region takes its turn."""

MeshPoints = Literal[468, 478]
Search = Literal["when lost", "every picture"]


class _Variant(NamedTuple):
    model: str
    pixels: int
    outputs: tuple[str, str]


_VARIANTS: dict[MeshPoints, _Variant] = {
    468: _Variant("face_mesh468", 192, ("conv2d_31", "conv2d_21")),
    478: _Variant("face_mesh478", 256, ("Identity_1", "Identity")),
}


class FaceMesh:
    """A `Detector` in the layout mediapipe478; the irises are NaN from the mesh of 468 points.

    `search`: "when lost" looks for the face only where the mesh has lost it, as MediaPipe does on video; "every
    picture" treats each picture for itself.
    """

    def __init__(self, points: MeshPoints = 478, search: Search = "when lost") -> None:
        """InputError where the models face_detector or face_mesh478 (or 468) are not on this machine."""
        variant = _VARIANTS[points]
        self._detect = FaceDetector(model_path("face_detector"))
        self._net = Net(model_path(variant.model), variant.outputs)
        self._pixels = variant.pixels
        self._search = search
        self.reset()

    @property
    def layout(self) -> MarkerLayout:
        """Names by the number of the vertex."""
        return MESH478

    def reset(self) -> None:
        """Search the next picture."""
        self._region: Region | None = None

    def __call__(self, picture: NDArray[np.uint8]) -> Landmarks | None:
        """The mesh of the face in `picture` (H, W, 3) BGR; None where there is none."""
        if self._region is not None and self._search == "when lost":
            followed = self._look(picture, self._region)
            if followed is not None:
                return followed
        self._region = self._detect(picture)
        return None if self._region is None else self._look(picture, self._region)

    def _look(self, picture: NDArray[np.uint8], region: Region) -> Landmarks | None:
        score, mesh = self._net(picture_blob(region.cut(picture, self._pixels), 1 / 255, 0.0))
        confidence = float(sigmoid(score)[0])
        if confidence < LEAST_SCORE:
            self._region = None
            return None
        points = np.full((len(MESH478.names), 3), np.nan)
        seen = region.to_picture(mesh.astype(float).reshape(-1, 3), self._pixels)
        points[: len(seen)] = seen
        corners = np.stack([seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)])
        self._region = Region.around(corners, seen[EYE_RIGHT, :2], seen[EYE_LEFT, :2])
        return Landmarks(MESH478, points, confidence)


class Mesh68:
    """A `Detector` of the 68 landmarks of iBUG, read off the mesh; without depth, as other detectors of the 68."""

    def __init__(self, mesh: FaceMesh) -> None:
        self._mesh = mesh

    @property
    def layout(self) -> MarkerLayout:
        """The 68 of iBUG."""
        return IBUG68

    def reset(self) -> None:
        """As the mesh."""
        self._mesh.reset()

    def __call__(self, picture: NDArray[np.uint8]) -> Landmarks | None:
        """Those in `picture` (H, W, 3) BGR; None where there is no face."""
        found = self._mesh(picture)
        if found is None:
            return None
        points = ibug68.from_mesh(found.points)
        points[:, 2] = np.nan
        return Landmarks(IBUG68, points, found.confidence)
