"""Where a rigid body is, from a few of its markers: a fast weighted fit, and one that a bad marker cannot tilt.

The fit minimises sum w |p_world - T_world_head p_head|^2 by the largest eigenvector of a symmetric 4x4 matrix (Horn
1987); the same motion as `retarget.geometry.kabsch`, in a third of its time for a handful of points. The robust fit
repeats it with the weights of Geman and McClure, w = 1 / (1 + r^2 / scale^2)^2, so that a marker that strays by
several times `scale` hardly counts. Points are homogeneous here, (N, 4) with 1 in the last column.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Quat = tuple[float, float, float, float]
    Vector = tuple[float, float, float]

LEAST = 3
"""Points that a rigid motion needs."""
REWEIGHTINGS = 1
"""After a start that is expected to be right."""
REWEIGHTINGS_ALONE = 4
"""Without one."""
EXPECTED = 3.0
"""How far from the expected pose a good marker may be, in units of `scale`."""
BROKEN = 5.0
"""Two residuals beyond this, in units of `scale`, and a swap is looked for."""
DOUBTFUL = 2.0
"""One residual beyond this, where no pose is expected, and a swap or a bad marker is looked for."""
CLEARLY = 3.0
"""How many times better another explanation must be before it is believed."""


class Fit(NamedTuple):
    """A rigid motion, and how well the points determine it."""

    quat: Quat
    """xyzw of the rotation from ``head`` to ``world``."""
    T_world_head: Array
    """(4, 4)."""
    breadth_m: float
    """How far the points spread about their best line; near zero the turn about that line is arbitrary."""


def homogeneous(points: Array) -> Array:
    """(N, 4) of (N, 3)."""
    return np.concatenate([points, np.ones((len(points), 1))], axis=1)


def fit_rigid(head: Array, world: Array, weights: Array) -> Fit:
    """The motion from `head` (N, 4) to `world` (N, 4), both homogeneous and finite; weights (N, 1), not all zero."""
    sums: list[list[float]] = ((head * weights).T @ world).tolist()
    (xx, xy, xz, hx), (yx, yy, yz, hy), (zx, zy, zz, hz), (wx, wy, wz, total) = sums
    hx, hy, hz = hx / total, hy / total, hz / total
    xx, xy, xz = xx - hx * wx, xy - hx * wy, xz - hx * wz
    yx, yy, yz = yx - hy * wx, yy - hy * wy, yz - hy * wz
    zx, zy, zz = zx - hz * wx, zy - hz * wy, zz - hz * wz
    # Horn 1987, section 4, ordered xyzw; only the lower triangle is read.
    lower = [
        [xx - yy - zz, 0.0, 0.0, 0.0],
        [xy + yx, yy - xx - zz, 0.0, 0.0],
        [zx + xz, yz + zy, zz - xx - yy, 0.0],
        [yz - zy, zx - xz, xy - yx, xx + yy + zz],
    ]
    values, vectors = np.linalg.eigh(np.array(lower))
    quat = tuple(vectors[:, 3].tolist())
    gap = float(values[3] - values[2])  # twice the sum of the two smaller singular values of the covariance
    T = pose(quat, (hx, hy, hz), (wx / total, wy / total, wz / total))
    return Fit(quat, T, math.sqrt(max(gap, 0.0) / (2 * total)))


def pose(quat: Quat, at_head: Vector, at_world: Vector) -> Array:
    """T_world_head (4, 4) of the turn `quat` that takes the point `at_head` to `at_world`."""
    x, y, z, w = quat
    a, b, c = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    d, e, f = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    g, h, i = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
    hx, hy, hz = at_head
    wx, wy, wz = at_world
    return np.array(
        [
            [a, b, c, wx - a * hx - b * hy - c * hz],
            [d, e, f, wy - d * hx - e * hy - f * hz],
            [g, h, i, wz - g * hx - h * hy - i * hz],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def squared_residuals(T_world_head: Array, head: Array, world: Array) -> Array:
    """|p_world - T_world_head p_head|^2 (N,) [m^2]."""
    off = head @ T_world_head.T
    off -= world
    residuals: Array = np.einsum("ij,ij->i", off, off)
    return residuals


class RobustFit(NamedTuple):
    """A `Fit` in which bad markers hardly count."""

    fit: Fit
    order: tuple[int, ...] | None
    """Which of the given world points stands for each head point, where some were swapped; None where none was."""


def fit_robust(head: Array, world: Array, scale: float, expected: Array | None = None) -> RobustFit:
    """The motion from `head` (N, 4) to `world` (N, 4), N >= 3, both finite; `scale` [m] is how far a good marker
    strays.

    `expected` is about where the head should be, T_world_head (4, 4), from the frames before: it only tells which
    markers to doubt, so it does not hold back a fast head. A band of four in a plane needs it, because of four such
    markers no single frame tells which one has left the plane. Where the points contradict each other all the same,
    each marker is left out in turn and markers are exchanged, and what explains the points clearly better is the start
    instead.
    """
    weights = np.ones((len(head), 1))
    alone = expected is None or len(head) == LEAST  # three points leave nothing to tell a bad one by
    if expected is not None and not alone:
        weights = _weights(squared_residuals(expected, head, world), EXPECTED * scale)
    fit = fit_rigid(head, world, weights)
    squares = squared_residuals(fit.T_world_head, head, world)
    order = None
    if _contradictory(squares, scale, alone):
        fit, order = _explained(fit, head, world, scale)
        world = world if order is None else world[list(order)]
        squares = squared_residuals(fit.T_world_head, head, world)
    if len(head) > LEAST:
        for _ in range(REWEIGHTINGS_ALONE if alone else REWEIGHTINGS):
            fit = fit_rigid(head, world, _weights(squares, scale))
            squares = squared_residuals(fit.T_world_head, head, world)
    return RobustFit(fit, order)


def _contradictory(squares: Array, scale: float, alone: bool) -> bool:
    if alone:
        return bool(squares.max() > (DOUBTFUL * scale) ** 2)
    worst = (BROKEN * scale) ** 2
    return bool(np.count_nonzero(squares > worst) > 1)


def _weights(squares: Array, scale: float) -> Array:
    root = 1.0 / (1.0 + squares * (1.0 / (scale * scale)))
    return (root * root)[:, None]


def _explained(plain: Fit, head: Array, world: Array, scale: float) -> RobustFit:
    """The plain fit, or the one with a marker left out or with markers exchanged, if that is clearly better."""
    n = len(head)
    orders, weights = _hypotheses(n)
    costs = []
    fits = []
    for order, w in zip(orders, weights, strict=True):
        fits.append(fit_rigid(head, world[order], w))
        costs.append(_cost(fits[-1], head, world[order], scale))
    best = int(np.argmin(costs))
    if costs[best] * CLEARLY > _cost(plain, head, world, scale):
        return RobustFit(plain, None)
    identity = bool((orders[best] == np.arange(n)).all())
    return RobustFit(fits[best], None if identity else tuple(orders[best].tolist()))


def _cost(fit: Fit, head: Array, world: Array, scale: float) -> float:
    """The sum of Geman and McClure's bounded penalty, in units of scale^2."""
    squares = squared_residuals(fit.T_world_head, head, world) / scale**2
    return float((squares / (1 + squares)).sum())


def _hypotheses(n: int) -> tuple[list[NDArray[np.intp]], list[Array]]:
    """Each marker left out, where enough remain; then all orders of up to four markers, else all exchanges of two."""
    orders: list[NDArray[np.intp]] = []
    weights: list[Array] = []
    for i in range(n if n > LEAST else 0):
        orders.append(np.arange(n))
        weights.append(np.ones((n, 1)))
        weights[-1][i] = 0.0
    if n <= 4:
        orders += [np.array(order) for order in itertools.permutations(range(n))][1:]
    else:
        for i, j in itertools.combinations(range(n), 2):
            order = np.arange(n)
            order[[i, j]] = j, i
            orders.append(order)
    weights += [np.ones((n, 1))] * (len(orders) - len(weights))
    return orders, weights
