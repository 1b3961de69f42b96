"""The second detector: OpenCV's Haar cascade for the face and FacemarkLBF for 68 landmarks.

Its model, a YAML file such as OpenCV's own ``lbfmodel.yaml``, is the user's: those that are about were trained on data
for research. Ren et al. 2014, "Face Alignment at 3000 FPS via Regressing Local Binary Features".
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget.camera.landmarks import IBUG68, Landmarks
from retarget.camera.quiet import no_stdout
from retarget.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerLayout

CASCADE = "haarcascade_frontalface_alt2.xml"
SMALLEST_SHARE = 0.15
"""Side of the smallest face that is looked for, over the picture's shorter side."""
HEAD_BYTES = 1024
"""In which a model tells its size; OpenCV would take any other YAML file for an empty model."""
TURNS_DEG = (0.0, 20.0, -20.0)
"""By which the picture is turned until the cascade, which only knows upright faces, sees one."""


class Facemark:
    """A `Detector` in the layout ibug68, without depth."""

    def __init__(self, model: Path) -> None:
        """InputError where the LBF model is not at `model` or cannot be read, or OpenCV lacks either part."""
        import cv2

        if not model.is_file():
            raise InputError(f"There is no LBF model {model}; give the path of a FacemarkLBF .yaml file.")
        with model.open("rb") as file:
            if b"n_landmarks: 68" not in file.read(HEAD_BYTES):
                raise InputError(f"{model} is no model of FacemarkLBF: it does not begin as one with 68 landmarks.")
        cascade = Path(getattr(getattr(cv2, "data", None), "haarcascades", "")) / CASCADE
        if not cascade.is_file() or not hasattr(cv2, "face"):
            raise InputError(
                "This OpenCV has no Haar cascades or no face module; install opencv-contrib-python-headless 4."
            )
        self._cascade = cv2.CascadeClassifier(str(cascade))
        self._facemark: Any = cv2.face.createFacemarkLBF()
        try:
            with no_stdout():
                self._facemark.loadModel(str(model))
        except cv2.error as error:
            raise InputError(f"{model} is no model of FacemarkLBF: {error.err}.") from error
        self.reset()

    @property
    def layout(self) -> MarkerLayout:
        """The 68 of iBUG."""
        return IBUG68

    def reset(self) -> None:
        """Begin with an upright face again."""
        self._turn_deg = 0.0

    def __call__(self, picture: NDArray[np.uint8]) -> Landmarks | None:
        """The landmarks of the largest face in `picture` (H, W, 3) BGR; None where there is none."""
        for turn_deg in sorted(TURNS_DEG, key=lambda turn: turn != self._turn_deg):  # what fitted last is tried first
            points = self._look(picture, turn_deg)
            if points is not None:
                self._turn_deg = turn_deg
                return Landmarks(IBUG68, points, 1.0)
        return None

    def _look(self, picture: NDArray[np.uint8], turn_deg: float) -> NDArray[np.float64] | None:
        """(68, 3) [px] in `picture` turned about its middle, and turned back."""
        import cv2

        height, width = picture.shape[:2]
        turn: NDArray[np.float64] = np.array(cv2.getRotationMatrix2D((width / 2, height / 2), turn_deg, 1.0), float)
        turned = np.asarray(cv2.warpAffine(picture, turn, (width, height)) if turn_deg else picture, np.uint8)
        box = self._largest_face(turned)
        if box is None:
            return None
        found, faces = self._facemark.fit(turned, box[None])
        if not found:
            return None
        points = np.full((len(IBUG68.names), 3), np.nan)
        points[:, :2] = (faces[0][0].astype(float) - turn[:, 2]) @ turn[:, :2]
        return points

    def _largest_face(self, picture: NDArray[np.uint8]) -> NDArray[np.int32] | None:
        """x, y, width and height [px]."""
        import cv2

        grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
        least = max(20, int(SMALLEST_SHARE * min(picture.shape[:2])))
        boxes = np.asarray(self._cascade.detectMultiScale(grey, 1.1, 3, minSize=(least, least)), np.int32)
        if not len(boxes):
            return None
        largest: NDArray[np.int32] = boxes[np.argmax(boxes[:, 2] * boxes[:, 3])]
        return largest
