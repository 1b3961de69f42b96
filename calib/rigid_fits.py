"""Rigid motions of many frames at once: the same fits as `retarget.markers.rigid`, offline and without a loop.

Every frame is explained by all its markers and by all but one; the explanation with the smallest bounded cost (Geman
and McClure) starts a few reweighted fits. Frames whose pose jumps off those around it, as when one of three markers is
a reflection, take the pose of their neighbours. Metres; ``T_world_head``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calib.rolling import rolling_mean, rolling_median
from retarget import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

LEAST = 3
"""Markers that a rigid motion needs."""
REWEIGHTINGS = 3
JUMP_M = 0.004
"""A head that is off its neighbours in time by this did not move; its markers were misread."""
REACH_M = 0.1
"""How far apart the points are that stand for a pose: about the size of a head."""


def rigid_fits(p_head: Array, p_world: Array, weights: Array) -> Array:
    """T_world_head (T, 4, 4), each minimising sum w |p_world - T p_head|^2; p_head (N, 3), p_world (T, N, 3), w (T, N).

    All zero weights where a point is not seen, whose value then does not matter. Kabsch 1976.
    """
    w = weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-12)
    world = np.where(weights[..., None] > 0, p_world, 0.0)
    mean_head, mean_world = w @ p_head, np.einsum("tn,tnx->tx", w, world)
    spread = np.einsum("tn,tnx,ny->txy", w, world, p_head) - mean_world[:, :, None] * mean_head[:, None, :]
    U, _, Vt = np.linalg.svd(spread)
    U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
    R = U @ Vt
    return geometry.transform(R, mean_world - np.einsum("txy,ty->tx", R, mean_head))


def robust_rigid_fits(p_head: Array, p_world: Array, scale_m: float) -> Array:
    """T_world_head (T, 4, 4) of every frame, NaN where fewer than three markers are seen; arguments as `rigid_fits`.

    `scale_m` is how far a good marker strays from the rigid head.
    """
    seen = np.isfinite(p_world.sum(axis=2))
    weights = seen.astype(float)
    T = rigid_fits(p_head, p_world, weights)
    best = _costs(T, p_head, p_world, scale_m)
    for left_out in range(len(p_head)):
        fewer = weights.copy()
        fewer[:, left_out] = 0.0
        T_fewer = rigid_fits(p_head, p_world, fewer)
        costs = np.where(fewer.sum(axis=1) >= LEAST, _costs(T_fewer, p_head, p_world, scale_m), np.inf)
        better = costs < best
        T[better], best = T_fewer[better], np.minimum(costs, best)
    for _ in range(REWEIGHTINGS):
        T = rigid_fits(p_head, p_world, _weights(T, p_head, p_world, scale_m))
    T[seen.sum(axis=1) < LEAST] = np.nan
    return T


def residuals(T_world_head: Array, p_head: Array, p_world: Array) -> Array:
    """|p_world - T_world_head p_head| (T, N) [m]; NaN where a marker or the head is not seen."""
    at: Array = p_head @ T_world_head[:, :3, :3].swapaxes(1, 2) + T_world_head[:, None, :3, 3]
    distances: Array = np.linalg.norm(p_world - at, axis=2)
    return distances


def into_head(T_world_head: Array, p_world: Array) -> Array:
    """(T, M, 3) in ``head`` of positions in ``world``."""
    p_head: Array = (p_world - T_world_head[:, None, :3, 3]) @ T_world_head[:, :3, :3]
    return p_head


def steady(T_world_head: Array, about: Array, half: int, smooth: int) -> Array:
    """The poses (T, 4, 4) without single jumps, and with the jitter of single frames evened out.

    A pose is four points, as far apart as a head is large, at `about` (3,) [m], ``head``; medians and means over `half`
    and `smooth` frames on either side are taken of the points, and the head is laid through them again.
    """
    corners = about + np.vstack([np.zeros(3), REACH_M * np.eye(3)])
    points = corners @ T_world_head[:, :3, :3].swapaxes(1, 2) + T_world_head[:, None, :3, 3]
    usual = rolling_median(points, half)
    jumped = np.linalg.norm(points - usual, axis=2).max(axis=1) > JUMP_M
    points = rolling_mean(np.where(jumped[:, None, None], usual, points), smooth)
    T = rigid_fits(corners, points, np.isfinite(points).all(axis=2).astype(float))
    T[~np.isfinite(points).all(axis=(1, 2)) | ~np.isfinite(T_world_head).all(axis=(1, 2))] = np.nan
    return T


def _costs(T: Array, p_head: Array, p_world: Array, scale_m: float) -> Array:
    squares = (residuals(T, p_head, p_world) / scale_m) ** 2
    costs: Array = np.nansum(squares / (1 + squares), axis=1)
    return costs


def _weights(T: Array, p_head: Array, p_world: Array, scale_m: float) -> Array:
    squares = (residuals(T, p_head, p_world) / scale_m) ** 2
    return np.nan_to_num(1.0 / (1.0 + squares) ** 2)
