"""MediaPipe's own net from the 478 points to the weights of 51 expressions, as an alternative to solving for them.

It reads x and y of 146 points in pixels. Grishchenko et al. 2023, "Blendshapes GHUM", arXiv 2309.05782. Measured on
video, cheekPuff and both noseSneer stay near 0 whatever the face does, and there is no tongueOut.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.camera.landmarks import MESH478
from retarget.camera.metric import pixels_of
from retarget.camera.models import model_path
from retarget.camera.net import Net
from retarget.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.camera.landmarks import Landmarks
    from retarget.frames import MarkerFrame

    Array = NDArray[np.float64]

VIRTUAL_SIZE = (640, 480)
"""Of the picture through which the net looks at points in metres [px]."""

_SIDED = {
    "browDown", "browOuterUp", "cheekSquint", "eyeBlink", "eyeLookDown", "eyeLookIn", "eyeLookOut", "eyeLookUp",
    "eyeSquint", "eyeWide", "mouthDimple", "mouthFrown", "mouthLowerDown", "mouthPress", "mouthSmile", "mouthStretch",
    "mouthUpperUp", "noseSneer", "jaw", "mouth",
}  # fmt: skip
_SINGLE = {
    "browInnerUp", "cheekPuff", "jawForward", "jawOpen", "mouthClose", "mouthFunnel", "mouthPucker", "mouthRollLower",
    "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper",
}  # fmt: skip
NAMES = tuple(sorted(_SINGLE | {name + side for name in _SIDED for side in ("Left", "Right")}))
"""(51,) ARKit's names in the order of the weights, which is alphabetical."""

_POINTS = np.array(
    [
        0, 1, 4, 5, 6, 7, 8, 10, 13, 14, 17, 21, 33, 37, 39, 40, 46, 52, 53, 54, 55, 58, 61, 63, 65, 66, 67, 70, 78, 80,
        81, 82, 84, 87, 88, 91, 93, 95, 103, 105, 107, 109, 127, 132, 133, 136, 144, 145, 146, 148, 149, 150, 152, 153,
        154, 155, 157, 158, 159, 160, 161, 162, 163, 168, 172, 173, 176, 178, 181, 185, 191, 195, 197, 234, 246, 249,
        251, 263, 267, 269, 270, 276, 282, 283, 284, 285, 288, 291, 293, 295, 296, 297, 300, 308, 310, 311, 312, 314,
        317, 318, 321, 323, 324, 332, 334, 336, 338, 356, 361, 362, 365, 373, 374, 375, 377, 378, 379, 380, 381, 382,
        384, 385, 386, 387, 388, 389, 390, 397, 398, 400, 402, 405, 409, 415, 454, 466, 468, 469, 470, 471, 472, 473,
        474, 475, 476, 477,
    ]
)  # fmt: skip


class BlendshapeNet:
    """Weights of `NAMES` from a face mesh with irises."""

    def __init__(self) -> None:
        """InputError where the model face_blendshapes is not on this machine."""
        self._net = Net(model_path("face_blendshapes"), ("StatefulPartitionedCall:0",))

    def __call__(self, landmarks: Landmarks | None) -> Array:
        """(51,) in [0, 1]; NaN without a face, or where the mesh has no irises."""
        return self._weights(None if landmarks is None else landmarks.points[:, :2])

    def of_frame(self, frame: MarkerFrame) -> Array:
        """(51,) as above, for a frame of a face mesh in ``camera`` [m], as it comes over the network; the net minds
        neither the picture's size nor where the face is in it. InputError for other markers.
        """
        if frame.layout.names != MESH478.names:
            raise InputError(f"Weights by MediaPipe's net need {MESH478.name}; the markers are {frame.layout.name}.")
        return self._weights(pixels_of(frame.positions, VIRTUAL_SIZE))

    def _weights(self, pixels: Array | None) -> Array:
        if pixels is None or not np.isfinite(pixels[_POINTS]).all():
            return np.full(len(NAMES), np.nan)
        weights = self._net(pixels[_POINTS][None].astype(np.float32))[0][1:]  # the first is what is left for neutral
        return np.asarray(np.clip(weights.astype(float), 0.0, 1.0))
