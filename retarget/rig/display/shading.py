"""Light on a face, computed per vertex in numpy: a key, a fill and a rim light that travel with the camera.

Light adds up in linear RGB; pictures are sRGB (IEC 61966-2-1). Wrapped diffuse light stands in for the softness of skin
(Green 2004, "Real-Time Approximations to Subsurface Scattering"), the gloss is Blinn-Phong.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float32]


def _units(rows: ArrayLike) -> Floats:
    v = np.asarray(rows, np.float32)
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True), np.float32)


LIGHT_DIRECTIONS = _units([[-0.6, 0.6, 0.7], [0.85, 0.1, 0.65], [0.45, 0.75, -0.6]])
"""(3, 3): towards the key, the fill and the rim light, ``camera``."""
LIGHT_COLORS = np.array([[0.94, 0.89, 0.82], [0.13, 0.15, 0.19], [0.30, 0.32, 0.36]], np.float32)
"""(3, 3) linear RGB that each gives a white surface that faces it."""
SKY, GROUND = np.array([0.16, 0.17, 0.19], np.float32), np.array([0.08, 0.07, 0.06], np.float32)
"""Linear RGB of the light from all around, at a normal that points up and down."""
WRAP = np.float32(0.2)
"""How far light creeps round past the horizon, as the cosine that still gets none."""
EVENLY = (SKY + GROUND) / 2 + WRAP / (1 + WRAP) / 3 * LIGHT_COLORS[:2].sum(axis=0)
"""Linear RGB from all around for a shader that knows neither sky nor wrapping: about as bright in the mean."""


def srgb_from_linear(linear: ArrayLike) -> Floats:
    """Encode as sRGB in [0, 1] linear light of any shape; light out of [0, 1] is clipped."""
    x = np.clip(np.asarray(linear, np.float32), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** np.float32(1 / 2.4) - 0.055).astype(np.float32)


def linear_from_srgb(srgb: ArrayLike) -> Floats:
    """Linear light in [0, 1] of sRGB in [0, 1] of any shape."""
    x = np.clip(np.asarray(srgb, np.float32), 0.0, 1.0)
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** np.float32(2.4)).astype(np.float32)


def diffuse(normals: Floats, R_rig_camera: Floats) -> Floats:
    """Linear RGB (V, 3) that a white surface of unit normals (V, 3), ``rig``, sends back; the lights turn with R."""
    cosines = normals @ (R_rig_camera @ LIGHT_DIRECTIONS.T)
    wrapped = np.maximum((cosines + WRAP) / (1 + WRAP), 0)
    up = 0.5 + 0.5 * (normals @ R_rig_camera[:, 1])
    return np.asarray(wrapped @ LIGHT_COLORS + GROUND + up[:, None] * (SKY - GROUND), np.float32)


def gloss(normals: Floats, R_rig_camera: Floats, roughness: float) -> Floats:
    """Linear RGB (V, 3) mirrored towards the camera, whatever the surface's colour; roughness in [0, 1] as in glTF."""
    halves = _units(LIGHT_DIRECTIONS + np.array([0.0, 0.0, 1.0], np.float32))
    doublings = round(float(np.interp(roughness, [0.2, 1.0], [6, 1])))
    lobe = np.maximum(normals @ (R_rig_camera @ halves.T), 0)
    for _ in range(doublings):  # the exponent is a power of two: squaring is cheaper than a power
        lobe *= lobe
    strength = np.float32(0.04 * (2**doublings + 8) / 8)  # Blinn-Phong keeps its energy by this factor
    return np.asarray(lobe @ (LIGHT_COLORS * strength), np.float32)
