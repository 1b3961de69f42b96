"""The 68 landmarks of the iBUG 300-W scheme: their groups, and where each lies on the 468-point face mesh.

Numbered from 0. The contour runs from the performer's right ear (0) over the chin (8) to his left ear (16); brows are
17 to 26, nose 27 to 35, right eye 36 to 41, left eye 42 to 47, outer lips 48 to 59, inner lips 60 to 67.
Sagonas et al. 2013, "300 Faces in-the-Wild Challenge", figure 1; left and right are the performer's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

COUNT = 68
CHIN, NOSE_TIP, NOSE_ROOT = 8, 30, 27
JAW_RIGHT, JAW_LEFT = 0, 16
EYE_RIGHT = (36, 37, 38, 39, 40, 41)
EYE_LEFT = (42, 43, 44, 45, 46, 47)
"""Corner on the performer's right, then clockwise in the picture: upper lid, other corner, lower lid."""
MOUTH_RIGHT, MOUTH_LEFT = 48, 54

_CONTOUR = (234, 93, 132, 58, 172, 150, 149, 148, 152, 377, 378, 379, 397, 288, 361, 323, 454)
_BROW_RIGHT, _BROW_LEFT = (70, 63, 105, 66, 107), (336, 296, 334, 293, 300)
_NOSE = (168, 6, 195, 4, 98, 97, 2, 326, 327)
_EYES = (33, 160, 158, 133, 153, 144, 362, 385, 387, 263, 373, 380)
_LIPS = (61, 40, 37, 0, 267, 270, 291, 405, 314, 17, 84, 181, 78, 82, 13, 312, 308, 317, 14, 87)

MESH_POINTS: NDArray[np.intp] = np.array((*_CONTOUR, *_BROW_RIGHT, *_BROW_LEFT, *_NOSE, *_EYES, *_LIPS), np.intp)
"""(68,) the vertex of the face mesh nearest to each landmark; the contour of the mesh follows the skull, that of the
scheme the silhouette, so 1 to 7 and 9 to 15 agree only roughly."""


def from_mesh(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., 68, D) of a face mesh (..., 468 or 478, D)."""
    return points[..., MESH_POINTS, :]
