"""Paint on a surface: every texel knows its place on the face, so a colour that is a function of place has no seams."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image
from scipy import ndimage

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Canvas:
    """The N texels of a square picture that lie under triangles."""

    covered: NDArray[np.bool_]
    """(size, size)."""
    triangle: NDArray[np.intp]
    """(N,) in the order of the covered texels."""
    barycentric: NDArray[np.float64]
    """(N, 3)."""

    def sample(self, corners: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (F, 3, ...) of the triangles' corners, interpolated at every texel: (N, ...)."""
        picked = corners[self.triangle]
        return np.asarray(np.einsum("nk,nk...->n...", self.barycentric, picked))

    def picture(self, colours: NDArray[np.float64]) -> NDArray[np.uint8]:
        """(size, size, 3) with `colours` (N, 3) in [0, 255]; texels outside repeat the nearest one."""
        whole = np.zeros((*self.covered.shape, 3))
        whole[self.covered] = colours
        rows, columns = ndimage.distance_transform_edt(~self.covered, return_distances=False, return_indices=True)
        return np.asarray(np.clip(whole[rows, columns] + 0.5, 0, 255), dtype=np.uint8)


def canvas(uv: NDArray[np.float64], size: int) -> Canvas:
    """Rasterise triangles with corners (F, 3, 2), origin in the upper left."""
    triangle = np.full((size, size), -1, dtype=np.intp)
    barycentric = np.zeros((size, size, 3))
    for number, corners in enumerate(uv * size - 0.5):
        low = np.maximum(np.ceil(corners.min(0)).astype(int), 0)
        high = np.minimum(np.floor(corners.max(0)).astype(int), size - 1)
        area = float(_cross(corners[1] - corners[0], corners[2] - corners[0]))
        if (high < low).any() or abs(area) < 1e-9:
            continue
        y, x = np.mgrid[low[1] : high[1] + 1, low[0] : high[0] + 1]
        away = [corners[k] - np.stack([x, y], axis=-1) for k in range(3)]
        shares = np.stack([_cross(away[(k + 1) % 3], away[(k + 2) % 3]) / area for k in range(3)], axis=-1)
        inside = (shares >= -1e-9).all(-1)
        triangle[y[inside], x[inside]] = number
        barycentric[y[inside], x[inside]] = shares[inside]
    covered = triangle >= 0
    return Canvas(covered, triangle[covered], barycentric[covered])


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def look_up(picture: NDArray[np.float64], uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bilinear values of `picture` (H, W) at `uv` (N, 2), origin at the lower left."""
    height, width = picture.shape
    rows, columns = (1 - uv[:, 1]) * height - 0.5, uv[:, 0] * width - 0.5
    return np.asarray(ndimage.map_coordinates(picture, [rows, columns], order=1, mode="nearest"))


def smoothstep(
    low: float | NDArray[np.float64], high: float | NDArray[np.float64], value: NDArray[np.float64]
) -> NDArray[np.float64]:
    """0 up to `low`, 1 from `high` on, smooth between; falls where `low` > `high`."""
    t = np.clip((value - low) / (high - low), 0, 1)
    return np.asarray(t * t * (3 - 2 * t))


def blend(
    below: NDArray[np.float64], colour: NDArray[np.float64] | tuple[float, float, float], alpha: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Lay `colour` over `below` (N, 3) with opacity `alpha` (N,)."""
    return np.asarray(below + np.clip(alpha, 0, 1)[:, None] * (np.asarray(colour) - below))


def jpeg(picture: NDArray[np.uint8], quality: int) -> bytes:
    """A picture (H, W, 3) as JPEG bytes."""
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "JPEG", quality=quality, subsampling=0, optimize=True)
    return stream.getvalue()


def png(picture: NDArray[np.uint8]) -> bytes:
    """A picture (H, W, 3) as PNG bytes."""
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "PNG", optimize=True)
    return stream.getvalue()
