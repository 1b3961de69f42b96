"""The second detector: OpenCV's Haar cascade for the face and FacemarkLBF for 68 landmarks.

Its model, a YAML file such as OpenCV's own ``lbfmodel.yaml``, is the user's: those that are about were trained on data
for research. Ren et al. 2014, "Face Alignment at 3000 FPS via Regressing Local Binary Features".
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget.camera.landmarks import IBUG68, Landmarks
from retarget.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerLayout

CASCADE = "haarcascade_frontalface_alt2.xml"
SMALLEST_SHARE = 0.15
"""Side of the smallest face that is looked for, over the picture's shorter side."""


class Facemark:
    """A `Detector` in the layout ibug68, without depth. It looks at each picture for itself."""

    def __init__(self, model: Path) -> None:
        """InputError where the LBF model is not at `model` or cannot be read, or OpenCV lacks either part."""
        import cv2

        if not model.is_file():
            raise InputError(f"There is no LBF model {model}; give the path of a FacemarkLBF .yaml file.")
        cascade = Path(getattr(getattr(cv2, "data", None), "haarcascades", "")) / CASCADE
        if not cascade.is_file() or not hasattr(cv2, "face"):
            raise InputError(
                "This OpenCV has no Haar cascades or no face module; install opencv-contrib-python-headless 4."
            )
        self._cascade = cv2.CascadeClassifier(str(cascade))
        self._facemark: Any = cv2.face.createFacemarkLBF()
        try:
            self._facemark.loadModel(str(model))
        except cv2.error as error:
            raise InputError(f"{model} is no model of FacemarkLBF: {error.err}.") from error

    @property
    def layout(self) -> MarkerLayout:
        """The 68 of iBUG."""
        return IBUG68

    def reset(self) -> None:
        """Nothing is remembered."""

    def __call__(self, picture: NDArray[np.uint8]) -> Landmarks | None:
        """The landmarks of the largest face in `picture` (H, W, 3) BGR; None where there is none."""
        import cv2

        grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
        least = max(20, int(SMALLEST_SHARE * min(grey.shape)))
        boxes = np.asarray(self._cascade.detectMultiScale(grey, 1.1, 3, minSize=(least, least)))
        if not len(boxes):
            return None
        largest = boxes[np.argmax(boxes[:, 2] * boxes[:, 3])]
        found, faces = self._facemark.fit(picture, largest[None])
        if not found:
            return None
        points = np.full((len(IBUG68.names), 3), np.nan)
        points[:, :2] = faces[0][0]
        return Landmarks(IBUG68, points, 1.0)
