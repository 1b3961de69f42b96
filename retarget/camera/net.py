"""A neural network out of a TFLite file, run by OpenCV alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray


class Net:
    """Gives the named outputs for one input. Not to be called from two threads at once."""

    def __init__(self, path: Path, outputs: tuple[str, ...]) -> None:
        """InputError where OpenCV cannot read the file at `path`."""
        import cv2

        try:
            self._net = cv2.dnn.readNetFromTFLite(str(path))
        except cv2.error as error:
            raise InputError(f"OpenCV cannot read the network {path}: {error.err}.") from error
        self._outputs = outputs

    def __call__(self, blob: NDArray[np.float32]) -> tuple[NDArray[np.float32], ...]:
        """The outputs, flat, for `blob` in the shape that the network wants."""
        self._net.setInput(blob)
        return tuple(np.asarray(out, np.float32).ravel().copy() for out in self._net.forward(self._outputs))


def picture_blob(picture: NDArray[np.uint8], scale: float, shift: float) -> NDArray[np.float32]:
    """(1, 3, H, W) RGB, `scale` * (value - `shift`), of a `picture` (H, W, 3) BGR."""
    import cv2

    blob = cv2.dnn.blobFromImage(picture, scale, mean=(shift, shift, shift), swapRB=True)
    return np.asarray(blob, np.float32)


def sigmoid(x: NDArray[np.float32]) -> NDArray[np.float64]:
    """Elementwise, in [0, 1], without overflow."""
    y: NDArray[np.float64] = 0.5 * (1.0 + np.tanh(0.5 * x.astype(float)))
    return y
