"""Rigid transforms, quaternions and fits of point sets. numpy only.

Quaternions are xyzw and of unit length. ``T_a_b`` maps coordinates in b to a: ``p_a = T_a_b @ p_b``. Every function
takes any number of leading axes unless it says otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

Quat = tuple[float, float, float, float]
Rows = Sequence[Sequence[float]]
IDENTITY_QUAT = np.array([0.0, 0.0, 0.0, 1.0])


def transform(R_a_b: ArrayLike, t_a_b: ArrayLike) -> Array:
    """(..., 4, 4) from a rotation (..., 3, 3) and a translation (..., 3)."""
    R, t = np.asarray(R_a_b, float), np.asarray(t_a_b, float)
    T = np.zeros((*np.broadcast_shapes(R.shape[:-2], t.shape[:-1]), 4, 4))
    T[..., :3, :3] = R
    T[..., :3, 3] = t
    T[..., 3, 3] = 1.0
    return T


def inverse(T_a_b: Array) -> Array:
    """T_b_a of a rigid (..., 4, 4); exact to rounding, without a general inverse."""
    R = np.swapaxes(T_a_b[..., :3, :3], -1, -2)
    return transform(R, -(R @ T_a_b[..., :3, 3:])[..., 0])


def apply(T_a_b: Array, p_b: ArrayLike) -> Array:
    """p_a (N, 3) from one T_a_b (4, 4) and p_b (N, 3); NaN rows stay NaN."""
    p_a: Array = np.asarray(p_b, float) @ T_a_b[:3, :3].T + T_a_b[:3, 3]
    return p_a


def quat_from_axis_angle(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Unit quaternion (..., 4) of a turn by `angle` [rad] (...) about the unit `axis` (..., 3)."""
    half = np.asarray(angle, float)[..., None] / 2
    return np.concatenate([np.asarray(axis, float) * np.sin(half), np.cos(half)], axis=-1)


def quat_multiply(a: ArrayLike, b: ArrayLike) -> Array:
    """Hamilton product (..., 4): first the turn `b`, then `a`."""
    ax, ay, az, aw = np.moveaxis(np.asarray(a, float), -1, 0)
    bx, by, bz, bw = np.moveaxis(np.asarray(b, float), -1, 0)
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=-1,
    )


def quat_conjugate(q: ArrayLike) -> Array:
    """The opposite turn (..., 4)."""
    conjugate: Array = np.asarray(q, float) * np.array([-1.0, -1.0, -1.0, 1.0])
    return conjugate


def matrix_from_quat(q: ArrayLike) -> Array:
    """Rotation matrix (..., 3, 3) of a unit quaternion (..., 4)."""
    x, y, z, w = np.moveaxis(np.asarray(q, float), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quat_from_matrix(R: ArrayLike) -> Array:
    """Unit quaternion (..., 4), w >= 0, of a rotation matrix (..., 3, 3)."""
    m = np.asarray(R, float)
    quats = [quat_from_rows(rows) for rows in m.reshape(-1, 3, 3).tolist()]
    return np.array(quats).reshape(*m.shape[:-2], 4)


def quat_from_rows(rows: Rows) -> Quat:
    """Unit quaternion, w >= 0, of one rotation matrix in plain numbers, which are ten times as fast as arrays for one.

    Takes the largest of the four candidates, so it is well conditioned for every rotation (Shepperd 1978).
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rows
    squares = (1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz)
    candidates = (
        (squares[0], xy + yx, xz + zx, zy - yz),
        (xy + yx, squares[1], yz + zy, xz - zx),
        (xz + zx, yz + zy, squares[2], yx - xy),
        (zy - yz, xz - zx, yx - xy, squares[3]),
    )
    x, y, z, w = candidates[squares.index(max(squares))]
    length = math.copysign(math.sqrt(x * x + y * y + z * z + w * w), w)
    return x / length, y / length, z / length, w / length


def align_hemisphere(q: ArrayLike, reference: ArrayLike) -> Array:
    """`q` or `-q`, the one nearer to `reference`; both (..., 4)."""
    q = np.asarray(q, float)
    return np.where(np.sum(q * np.asarray(reference, float), axis=-1, keepdims=True) < 0, -q, q)


def slerp(a: ArrayLike, b: ArrayLike, fraction: ArrayLike) -> Array:
    """The turn `fraction` (...) of the shorter way from `a` to `b`, both (..., 4) (Shoemake 1985)."""
    a = np.asarray(a, float)
    b = align_hemisphere(b, a)
    f = np.asarray(fraction, float)[..., None]
    # half the chords of the sum and the difference: exact for small angles, where the arc cosine loses half the digits
    angle = 2 * np.arctan2(np.linalg.norm(a - b, axis=-1, keepdims=True), np.linalg.norm(a + b, axis=-1, keepdims=True))
    near = angle < 1e-6  # the sine vanishes; the chord is the arc to rounding
    sine = np.where(near, 1.0, np.sin(angle))
    q = np.where(near, (1 - f) * a + f * b, (np.sin((1 - f) * angle) * a + np.sin(f * angle) * b) / sine)
    unit: Array = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return unit


def kabsch(p_b: Array, p_a: Array, weights: Array | None = None) -> Array:
    """T_a_b (4, 4) that minimises sum w |p_a - T_a_b p_b|^2 over rigid motions, for p_b, p_a (N, 3), weights (N,).

    All rows must be finite, and at least three of positive weight must not lie on one line, or the rotation is
    arbitrary about that line. Kabsch 1976, with the reflection ruled out (Umeyama 1991, eq. 40).
    """
    T, _ = _fit(p_b, p_a, weights)
    return T


def umeyama(p_b: Array, p_a: Array, weights: Array | None = None) -> tuple[Array, float]:
    """(T_a_b, s) that minimises sum w |p_a - (s R p_b + t)|^2; T_a_b holds R and t. As `kabsch`, with scale (Umeyama
    1991, eq. 42).
    """
    T, s = _fit(p_b, p_a, weights)
    w = np.ones(len(p_b)) if weights is None else np.asarray(weights, float)
    mean_a, mean_b = np.average(p_a, axis=0, weights=w), np.average(p_b, axis=0, weights=w)
    T[:3, 3] = mean_a - s * T[:3, :3] @ mean_b
    return T, s


def _fit(p_b: Array, p_a: Array, weights: Array | None) -> tuple[Array, float]:
    w = np.ones(len(p_b)) if weights is None else np.asarray(weights, float)
    w = w / w.sum()
    mean_a, mean_b = w @ p_a, w @ p_b
    a, b = p_a - mean_a, p_b - mean_b
    U, S, Vt = np.linalg.svd((a * w[:, None]).T @ b)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(U) * np.linalg.det(Vt))])
    R = (U * sign) @ Vt
    scale = float((S * sign).sum() / (w @ (b * b).sum(axis=1)))
    return transform(R, mean_a - R @ mean_b), scale
