"""Landmarks of a face in a picture, and the two schemes that they come in.

Pixels: x to the right, y down, the picture's corner at (0, 0). Depth, where a detector gives one, has the same unit and
grows away from the camera, from an origin of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from retarget.frames import MarkerLayout

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MESH478 = MarkerLayout("mediapipe478", tuple(f"mesh{i}" for i in range(478)))
"""The vertices of MediaPipe's face mesh, irises from 468 on: 468 and 473 are the centres of the right and left one."""
IBUG68 = MarkerLayout("ibug68", tuple(f"ibug{i}" for i in range(68)))
"""See `retarget.camera.ibug68`."""


@dataclass(frozen=True, slots=True, eq=False)
class Landmarks:
    """One face."""

    layout: MarkerLayout
    points: Array
    """(M, 3) [px], x, y and depth, NaN where not known."""
    confidence: float
    """That this is a face, 0 to 1."""


class Detector(Protocol):
    """Finds the landmarks of one face, picture after picture."""

    @property
    def layout(self) -> MarkerLayout:
        """The scheme of its landmarks."""

    def __call__(self, picture: NDArray[np.uint8]) -> Landmarks | None:
        """Those in `picture` (H, W, 3) BGR; None where there is no face."""

    def reset(self) -> None:
        """Forget where the face was."""
