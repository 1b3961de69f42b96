"""A square of a picture, turned with the face, and what it looks like as a small picture of its own.

Pixel coordinates have x to the right and y down; the corner of the picture is (0, 0) and lengths are pixels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MARGIN = 1.5
"""Side of the square over the longer side of the face's box."""


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """Where to look."""

    centre: Array
    """(2,) [px]."""
    side_px: float
    turn_rad: float
    """Clockwise in the picture."""

    @classmethod
    def whole(cls, picture: NDArray[np.uint8]) -> Region:
        """The smallest upright square that holds all of `picture` (H, W, 3)."""
        height, width = picture.shape[:2]
        return cls(np.array([width / 2, height / 2]), float(max(height, width)), 0.0)

    @classmethod
    def around(cls, box: Array, right_eye: Array, left_eye: Array) -> Region:
        """With margin about `box` (2, 2), its least and greatest corner, turned so that the eyes are level."""
        x, y = left_eye - right_eye
        return cls(box.mean(axis=0), MARGIN * float((box[1] - box[0]).max()), float(np.arctan2(y, x)))

    def to_picture(self, points: Array, pixels: int) -> Array:
        """(N, D) in the picture of `points` (N, D >= 2) in the square drawn with `pixels` a side; a third coordinate is
        only scaled.
        """
        placed = points * (self.side_px / pixels)
        placed[:, :2] = points[:, :2] @ self._affine(pixels)[:, :2].T + self._affine(pixels)[:, 2]
        return placed

    def cut(self, picture: NDArray[np.uint8], pixels: int) -> NDArray[np.uint8]:
        """(pixels, pixels, 3) the square, black beyond the picture's edges."""
        import cv2

        inverse = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return np.asarray(cv2.warpAffine(picture, self._affine(pixels), (pixels, pixels), flags=inverse), np.uint8)

    def _affine(self, pixels: int) -> Array:
        """(2, 3) from the square's pixels to the picture's."""
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        turn = np.array([[c, -s], [s, c]]) * (self.side_px / pixels)
        return np.column_stack([turn, self.centre - turn @ np.full(2, pixels / 2)])
