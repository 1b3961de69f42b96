"""Where the face is: BlazeFace, the detector in front of MediaPipe's mesh.

896 anchors on two grids; each answers with a score, a box and six points, the eyes first. Answers that overlap the best
one are averaged, weighted by score. Bazarevsky et al. 2019, "BlazeFace", arXiv 1907.05047.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.camera.net import Net, picture_blob, sigmoid
from retarget.camera.region import Region

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

PIXELS = 128
LEAST_SCORE = 0.5
OVERLAP = 0.3
"""Intersection over union from which two answers mean the same face."""
_GRIDS = ((16, 2), (8, 6))  # cells a side, anchors a cell


class FaceDetector:
    """Finds the surest face of a picture."""

    def __init__(self, path: Path) -> None:
        """`path` of the model face_detector."""
        self._net = Net(path, ("classificators", "regressors"))
        self._anchors = _anchors()

    def __call__(self, picture: NDArray[np.uint8]) -> Region | None:
        """The region of the face in `picture` (H, W, 3) BGR, None where there is none."""
        whole = Region.whole(picture)
        scores, answers = self._net(picture_blob(whole.cut(picture, PIXELS), 1 / 127.5, 127.5))
        found = self._best(sigmoid(scores), answers.astype(float).reshape(-1, 8, 2))
        if found is None:
            return None
        corners_and_eyes = whole.to_picture(found, PIXELS)
        return Region.around(corners_and_eyes[:2], corners_and_eyes[2], corners_and_eyes[3])

    def _best(self, scores: Array, answers: Array) -> Array | None:
        """(4, 2) least and greatest corner, right eye, left eye, in the detector's pixels."""
        best = int(scores.argmax())
        if scores[best] < LEAST_SCORE:
            return None
        centre, half = answers[:, 0] + self._anchors, answers[:, 1] / 2
        points = np.stack([centre - half, centre + half, *(answers[:, 2:4] + self._anchors[:, None]).swapaxes(0, 1)], 1)
        same = (scores >= LEAST_SCORE) & (_overlap(points[:, 0], points[:, 1], best) > OVERLAP)
        mean: Array = np.average(points[same], axis=0, weights=scores[same])
        return mean


def _overlap(least: Array, greatest: Array, best: int) -> Array:
    """(A,) intersection over union of every box with the box `best`."""
    common = np.minimum(greatest, greatest[best]) - np.maximum(least, least[best])
    intersection = np.clip(common, 0.0, None).prod(axis=1)
    areas = np.clip(greatest - least, 0.0, None).prod(axis=1)
    ratio: Array = intersection / np.maximum(areas + areas[best] - intersection, 1e-9)
    return ratio


def _anchors() -> Array:
    """(896, 2) centres in the detector's pixels."""
    centres = []
    for cells, each in _GRIDS:
        along = (np.arange(cells) + 0.5) * (PIXELS / cells)
        y, x = np.meshgrid(along, along, indexing="ij")
        centres.append(np.repeat(np.column_stack([x.ravel(), y.ravel()]), each, axis=0))
    return np.concatenate(centres)
