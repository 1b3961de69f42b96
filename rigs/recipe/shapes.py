"""The 52 blend shapes by ARKit's names, from the CC0 face units that belong to the base mesh.

The units crease the cheeks; their offsets are ironed there, while lips, lids, nostrils and brows keep their detail.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe.weights import surface_distance

if TYPE_CHECKING:
    from numpy.typing import NDArray

ROUNDS = 12
FIRM_M, LOOSE_M = 0.003, 0.012
"""Offsets stay as they are up to `FIRM_M` from the firm vertices, and are ironed fully from `LOOSE_M` on."""

ARKIT = (
    "eyeBlinkLeft",
    "eyeLookDownLeft",
    "eyeLookInLeft",
    "eyeLookOutLeft",
    "eyeLookUpLeft",
    "eyeSquintLeft",
    "eyeWideLeft",
    "eyeBlinkRight",
    "eyeLookDownRight",
    "eyeLookInRight",
    "eyeLookOutRight",
    "eyeLookUpRight",
    "eyeSquintRight",
    "eyeWideRight",
    "jawForward",
    "jawLeft",
    "jawRight",
    "jawOpen",
    "mouthClose",
    "mouthFunnel",
    "mouthPucker",
    "mouthLeft",
    "mouthRight",
    "mouthSmileLeft",
    "mouthSmileRight",
    "mouthFrownLeft",
    "mouthFrownRight",
    "mouthDimpleLeft",
    "mouthDimpleRight",
    "mouthStretchLeft",
    "mouthStretchRight",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    "mouthPressLeft",
    "mouthPressRight",
    "mouthLowerDownLeft",
    "mouthLowerDownRight",
    "mouthUpperUpLeft",
    "mouthUpperUpRight",
    "browDownLeft",
    "browDownRight",
    "browInnerUp",
    "browOuterUpLeft",
    "browOuterUpRight",
    "cheekPuff",
    "cheekSquintLeft",
    "cheekSquintRight",
    "noseSneerLeft",
    "noseSneerRight",
    "tongueOut",
)


def looseness(
    positions: NDArray[np.float64], triangles: NDArray[np.intp], firm: NDArray[np.intp]
) -> NDArray[np.float64]:
    """(V,) in [0, 1]: how much the offsets of each vertex are ironed, by its distance from the vertices `firm`."""
    distance = surface_distance(positions, triangles, firm)
    return np.asarray(np.clip((distance - FIRM_M) / (LOOSE_M - FIRM_M), 0, 1))


def iron(offsets: NDArray[np.float64], triangles: NDArray[np.intp], loose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Offsets (V, 3) averaged again and again with those of the neighbours, as far as `loose` (V,) lets them."""
    count = np.bincount(triangles.ravel(), minlength=len(offsets))[:, None] * 2
    for _ in range(ROUNDS):
        around = np.zeros_like(offsets)
        for k in range(3):
            np.add.at(around, triangles[:, k], offsets[triangles[:, (k + 1) % 3]] + offsets[triangles[:, (k + 2) % 3]])
        offsets = offsets + 0.6 * loose[:, None] * (around / np.maximum(count, 1) - offsets)
    return offsets
