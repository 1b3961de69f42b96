"""Paint pictures: every texel of the skin knows its place on the face, so colour is a function of place and has no seams."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Canvas:
    """What lies under each texel of a picture of `size` x `size`."""

    triangle: NDArray[np.intp]
    """(size, size) number of the triangle, of the nearest one where no triangle covers the texel."""
    barycentric: NDArray[np.float64]
    """(size, size, 3)."""

    def sample(self, triangles: NDArray[np.intp], values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (V, ...) of the vertices, interpolated at every texel."""
        return self.sample_corners(values[triangles])

    def sample_corners(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (F, 3, ...) of the corners, interpolated at every texel."""
        picked = values[self.triangle]
        weights = self.barycentric.reshape(self.barycentric.shape + (1,) * (picked.ndim - 3))
        return np.asarray((picked * weights).sum(axis=2))


def canvas(uv: NDArray[np.float64], size: int) -> Canvas:
    """Rasterise triangles with corners (F, 3, 2), origin in the upper left."""
    triangle = np.full((size, size), -1, dtype=np.intp)
    barycentric = np.zeros((size, size, 3))
    for number, corners in enumerate(uv * size - 0.5):
        low = np.maximum(np.ceil(corners.min(0)).astype(int), 0)
        high = np.minimum(np.floor(corners.max(0)).astype(int), size - 1)
        if (high < low).any():
            continue
        area = _cross(corners[1] - corners[0], corners[2] - corners[0])
        if abs(area) < 1e-9:
            continue
        y, x = np.mgrid[low[1] : high[1] + 1, low[0] : high[0] + 1]
        points = np.stack([x, y], axis=-1)
        shares = np.stack(
            [_cross(corners[(k + 1) % 3] - points, corners[(k + 2) % 3] - points) / area for k in range(3)], axis=-1
        )
        inside = (shares >= -1e-9).all(-1)
        triangle[y[inside], x[inside]] = number
        barycentric[y[inside], x[inside]] = shares[inside]
    empty = triangle < 0
    rows, columns = ndimage.distance_transform_edt(empty, return_distances=False, return_indices=True)
    return Canvas(triangle[rows, columns], barycentric[rows, columns])


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
