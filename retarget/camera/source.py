"""A camera, a video or a folder of pictures as a source of marker frames: the landmarks of one face.

    with CameraSource("camera:0") as source:
        for frame in source:
            ...

Positions are metres in the frame `camera` (`retarget.camera.metric`). A picture without a face is a frame of NaN rows,
so that what follows fills the gap as any other and finds the face again; that it is lost is said once.
"""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from retarget.camera.canonical import load_canonical_face
from retarget.camera.metric import metres_for
from retarget.camera.pictures import open_pictures
from retarget.errors import InputError
from retarget.frames import MarkerFrame

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import TracebackType

    from numpy.typing import NDArray

    from retarget.camera.landmarks import Detector, Landmarks
    from retarget.camera.metric import Metres
    from retarget.camera.pictures import Picture, Pictures

    Size = tuple[int, int]

log = logging.getLogger("retarget.camera")

DETECTORS = ("mediapipe", "mediapipe468", "mediapipe68", "lbf:MODEL.yaml")
"""What `make_detector` knows: a mesh of 478 points or, faster, 468; the 68 landmarks read off it, or by FacemarkLBF."""


class Seen(NamedTuple):
    """What the newest frame was made from."""

    picture: Picture
    landmarks: Landmarks | None


def make_detector(name: str) -> Detector:
    """The detector `name`, one of `DETECTORS`; InputError where there is none or its model is not here."""
    kind, _, model = name.partition(":")
    if name in {"mediapipe", "mediapipe468", "mediapipe68"}:
        from retarget.camera.face_mesh import FaceMesh, Mesh68

        mesh = FaceMesh(468 if name == "mediapipe468" else 478)
        return Mesh68(mesh) if name == "mediapipe68" else mesh
    if kind == "lbf" and model:
        from retarget.camera.facemark import Facemark

        return Facemark(Path(model))
    raise InputError(f"There is no detector {name!r}; there are: {', '.join(DETECTORS)}.")


class CameraSource:
    """Frames in the layout of the detector; a `Source` of the pipeline."""

    def __init__(self, where: str, detector: Detector | str = "mediapipe", focal_px: float | None = None) -> None:
        """`where` is ``camera:N``, a video file or a folder; `focal_px` [px] None is the picture's width.

        InputError where there is no such source or detector; a camera or file is opened on entering.
        """
        self._pictures: Pictures = open_pictures(where)
        self._detect = make_detector(detector) if isinstance(detector, str) else detector
        self._face = load_canonical_face()
        self._focal_px = focal_px
        self._size: Size | None = None
        self._metres: Metres | None = None
        self._is_lost = False
        self._given = self._without_face = 0
        self.seen: Seen | None = None
        """The picture and the landmarks of the frame given last."""

    @property
    def live(self) -> bool:
        """True for a camera."""
        return self._pictures.live

    @property
    def rate_hz(self) -> float | None:
        """Pictures a second, once the source is open; None if nobody tells."""
        return self._pictures.rate_hz

    @property
    def frame_count(self) -> int | None:
        """How many pictures there will be; None for a camera."""
        return self._pictures.count

    @property
    def confidence(self) -> float:
        """That the newest picture shows a face, 0 to 1."""
        return self.seen.landmarks.confidence if self.seen is not None and self.seen.landmarks is not None else 0.0

    def counts(self) -> dict[str, int]:
        """Pictures looked at, without a face, and overtaken by newer ones."""
        return {"received": self._given, "without a face": self._without_face, "dropped": self._pictures.dropped}

    def stop(self) -> None:
        """No frame after the current one."""
        self._pictures.stop()

    def __enter__(self) -> Self:
        self._pictures.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pictures.__exit__(kind, error, trace)

    def __iter__(self) -> Iterator[MarkerFrame]:
        for picture in self._pictures:
            landmarks = self._detect(picture.image)
            self._note(landmarks)
            self.seen = Seen(picture, landmarks)
            positions = self._place(picture, landmarks)
            yield MarkerFrame(picture.number, picture.time_s, picture.time_s, self._detect.layout, positions)

    def _place(self, picture: Picture, landmarks: Landmarks | None) -> NDArray[np.float64]:
        """(M, 3) [m], `camera`."""
        height, width = picture.image.shape[:2]
        if self._metres is None or self._size != (width, height):
            self._size = (width, height)
            self._metres = metres_for(self._detect.layout, self._face, self._size, self._focal_px)
        if landmarks is None:
            self._metres.reset()
            return np.full((len(self._detect.layout.names), 3), np.nan)
        return self._metres(landmarks)

    def _note(self, landmarks: Landmarks | None) -> None:
        self._given += 1
        self._without_face += landmarks is None
        if landmarks is None and not self._is_lost:
            log.warning("No face in the picture; the character eases to neutral until there is one.")
        elif landmarks is not None and self._is_lost:
            log.warning("A face is in the picture again.")
        self._is_lost = landmarks is None
