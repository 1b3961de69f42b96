"""The small pictures: the eye, seen from the front, and the strip of teeth over the tongue. sRGB in [0, 255]."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rigs.recipe.eyes import RINGS_DEG
from rigs.recipe.mouth import CREST, picture_edges
from rigs.recipe.noise import fractal, value_noise
from rigs.recipe.paint import blend, smoothstep

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.palette import Colour, Palette

EYE_SIZE = 512
MOUTH_SIZE = 512
VEINS = (196.0, 128.0, 118.0)
PUPIL = (9.0, 8.0, 9.0)
TOOTH = (232.0, 222.0, 202.0)
GUM = (188.0, 104.0, 104.0)
TONGUE = (186.0, 96.0, 94.0)


def eye(palette: Palette, iris_deg: float) -> NDArray[np.uint8]:
    """(H, W, 3): the distance from the middle is the angle from the front, the edge is the last ring of the sphere."""
    grid = (np.arange(EYE_SIZE) + 0.5) / EYE_SIZE * 2 - 1
    x, y = (values.ravel() for values in np.meshgrid(grid, -grid))
    angle = np.hypot(x, y) * RINGS_DEG[-1]
    colour = _sclera(palette, x, y, angle)
    colour = _iris(colour, Iris(palette.iris_outer, palette.iris_inner, iris_deg), x, y, angle)
    glint = np.hypot(x * RINGS_DEG[-1] + 6.5, y * RINGS_DEG[-1] - 9.0)
    colour = blend(colour, (255.0, 255.0, 255.0), 0.9 * smoothstep(4.4, 3.0, glint))
    soft = np.hypot(x * RINGS_DEG[-1] - 7.0, y * RINGS_DEG[-1] + 8.5)
    colour = blend(colour, (255.0, 255.0, 255.0), 0.16 * smoothstep(6.0, 2.0, soft))
    return _finish(colour, EYE_SIZE, EYE_SIZE)


def _sclera(
    palette: Palette, x: NDArray[np.float64], y: NDArray[np.float64], angle: NDArray[np.float64]
) -> NDArray[np.float64]:
    place = np.stack([x, y, np.zeros_like(x)], axis=1)
    colour = np.tile(np.array(palette.eye_white), (len(x), 1))
    colour = blend(colour, VEINS, 0.45 * smoothstep(38, 90, angle))
    turn = np.arctan2(y, x)
    thread = np.abs(fractal(np.stack([turn * 7, angle * 0.03, np.zeros_like(x)], axis=1) + 0.4 * place, 1.0, 3, seed=5))
    colour = blend(colour, VEINS, 0.35 * smoothstep(0.06, 0.0, thread) * smoothstep(34, 70, angle))
    above = 0.30 * smoothstep(0.02, 0.42, y)
    aside = 0.34 * smoothstep(26, 58, angle)
    return np.asarray(colour * ((1 - above) * (1 - aside))[:, None])


class Iris(NamedTuple):
    """Colours at the rim and at the pupil, and the radius as an angle from the front."""

    outer: Colour
    inner: Colour
    deg: float


def _iris(
    colour: NDArray[np.float64], iris: Iris, x: NDArray[np.float64], y: NDArray[np.float64], angle: NDArray[np.float64]
) -> NDArray[np.float64]:
    turn = np.arctan2(y, x)
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    reach = angle / iris.deg
    fibres = value_noise(ring * 11 + reach[:, None] * [0, 0, 1.6], 1.0, seed=7) * 0.6
    fibres += value_noise(ring * 26 + reach[:, None] * [0, 0, 1.2], 1.0, seed=8) * 0.4
    inner = smoothstep(0.78, 0.36, reach + 0.12 * fibres)
    shade = np.array(iris.outer) + inner[:, None] * (np.array(iris.inner) - iris.outer)
    shade = shade * (1.12 + 0.38 * fibres)[:, None]
    shade = (
        shade
        * (1 - 0.62 * smoothstep(0.82, 1.0, reach) - 0.30 * smoothstep(0.1, 0.9, y * RINGS_DEG[-1] / iris.deg))[:, None]
    )
    colour = blend(colour, shade, smoothstep(1.06, 0.97, reach))
    return blend(colour, PUPIL, smoothstep(0.43, 0.37, reach + 0.015 * fibres))


def mouth() -> NDArray[np.uint8]:
    """(H, W, 3): above, the teeth from the midline (left) to the last molar, gum on top; below, the tongue from root
    (left) to tip.
    """
    size = MOUTH_SIZE
    grid = (np.arange(size) + 0.5) / size
    x, y = (values.ravel() for values in np.meshgrid(grid, grid))
    strip = _teeth(x, 2 * y)
    return _finish(np.where((y < 0.5)[:, None], strip, _tongue(x, 2 * y - 1)), size, size)


def _teeth(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    edges = picture_edges()
    tooth = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    width = edges[tooth + 1] - edges[tooth]
    aside = np.abs(2 * (x - edges[tooth]) / width - 1)
    colour = np.tile(np.array(TOOTH), (len(x), 1))
    colour = blend(colour, (214, 192, 158), 0.55 * smoothstep(0.62, CREST, y))
    colour = blend(colour, (205, 208, 208), 0.35 * smoothstep(0.80, 0.9, y))
    colour = blend(colour, (120, 84, 66), 0.75 * smoothstep(0.86, 1.0, aside))
    colour = blend(colour, (150, 120, 100), 0.9 * smoothstep(0.93, 1.0, y))
    margin = CREST + 0.10 * (1 - aside**2) - 0.10
    gum = np.array(GUM) * (1 + 0.05 * value_noise(np.stack([x, y, 0 * x], axis=1), 0.03, seed=3))[:, None]
    colour = blend(colour, gum, smoothstep(margin + 0.025, margin - 0.01, y))
    return np.asarray(colour * (1 - 0.72 * smoothstep(0.22, 0.75, x))[:, None])


def _tongue(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    place = np.stack([x, y, 0 * x], axis=1)
    rough = fractal(place, 0.02, 2, seed=4)
    colour = np.array(TONGUE) * (1 + 0.07 * rough + 0.05 * fractal(place, 0.2, 2, seed=6))[:, None]
    return np.asarray(colour * (0.35 + 0.65 * smoothstep(0.1, 0.9, x))[:, None])


def _finish(colour: NDArray[np.float64], height: int, width: int) -> NDArray[np.uint8]:
    return np.clip(colour + 0.5, 0, 255).astype(np.uint8).reshape(height, width, 3)
