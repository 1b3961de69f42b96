"""A finished piece of the head, ready to be written: geometry, texture coordinates, skin and shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One glTF primitive."""

    name: str
    positions: NDArray[np.float64]
    """(V, 3) [m], ``rig``."""
    normals: NDArray[np.float64]
    """(V, 3), unit."""
    uv: NDArray[np.float64]
    """(V, 2), origin at the upper left."""
    triangles: NDArray[np.intp]
    """(F, 3)."""
    joints: NDArray[np.intp]
    """(V, 4) numbers of the rig's joints."""
    weights: NDArray[np.float64]
    """(V, 4), rows add up to 1."""
    shapes: dict[str, NDArray[np.float64]]
    """Offsets (V, 3) [m] of every shape that moves this part."""


def vertex_normals(positions: NDArray[np.float64], triangles: NDArray[np.intp]) -> NDArray[np.float64]:
    """(V, 3) unit normals, triangles weighted by their area; a vertex without triangles gets +Z."""
    normals = np.zeros_like(positions)
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    for k in range(3):
        np.add.at(normals, triangles[:, k], faces)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0, normals / np.maximum(length, 1e-15), [0.0, 0.0, 1.0])


def rigid(count: int, joint: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Joints and weights (count, 4) of vertices that follow one joint alone."""
    joints = np.zeros((count, 4), dtype=np.intp)
    weights = np.zeros((count, 4))
    joints[:, 0], weights[:, 0] = joint, 1.0
    return joints, weights


def join(name: str, parts: list[Part]) -> Part:
    """Several parts as one, in this order."""
    starts = np.cumsum([0, *(len(part.positions) for part in parts)])
    shapes: dict[str, NDArray[np.float64]] = {}
    for part, start in zip(parts, starts, strict=False):
        for shape, offsets in part.shapes.items():
            whole = shapes.setdefault(shape, np.zeros((int(starts[-1]), 3)))
            whole[start : start + len(offsets)] = offsets
    return Part(
        name,
        np.concatenate([part.positions for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.uv for part in parts]),
        np.concatenate([part.triangles + start for part, start in zip(parts, starts, strict=False)]),
        np.concatenate([part.joints for part in parts]),
        np.concatenate([part.weights for part in parts]),
        shapes,
    )
