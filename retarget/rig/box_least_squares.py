"""Least squares with every unknown between 0 and 1, exact and fast for the same matrix again and again.

Minimises |A w - b|^2 + alpha |w - w_before|^2 + beta sum(|A_i| w_i), 0 <= w <= 1, A_i the columns: linear equations on
the free unknowns once it is known which are at 0 and at 1. These are found by block principal pivoting: all unknowns on
the wrong side change sides at once (Judice and Pires, "A block principal pivoting algorithm for large-scale strictly
monotone linear complementarity problems", Computers & OR 21(5), 1994); where that goes round in circles an active-set
descent, one unknown at a time, ends it. Starting from the sides of the last frame it takes one or two rounds. AᵀA is
formed once for every set of rows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Mask = NDArray[np.bool_]
    Sides = NDArray[np.int8]

RIDGE = 1e-9
"""Part of the mean of AᵀA's diagonal that is added to it, so that unknowns that nothing tells apart have a solution."""
PATIENCE = 5
"""Rounds that may pass without fewer unknowns on the wrong side than ever before."""
MOST_ROUNDS = 20
"""Of the descent, for every unknown."""
TOLERANCE = 1e-9
"""How far beyond a bound counts as beyond, as a part of what matters: 1 for w, the size of Aᵀb for the slope."""


class BoxLeastSquares:
    """Solves for one matrix; keeps which unknowns were at a bound, as a guess for the next call, and nothing else."""

    def __init__(self, A: Array, smoothness: float = 0.0, sparsity: float = 0.0) -> None:
        """`A` (R, N); alpha is `smoothness` and beta `sparsity`, both 0 or more, in the units of |A w|^2 and |A w|."""
        self._A = np.asarray(A, float)
        self._smoothness, self._sparsity = smoothness, sparsity
        self._rows: Mask | None = None
        self._gram = np.zeros((0, 0))
        self._select(np.ones(len(self._A), bool))
        self.reset()

    def reset(self) -> None:
        """Forget the last call."""
        self._sides: Sides = np.full(self._A.shape[1], -1, np.int8)
        self.rounds = 0
        """Sets of equations solved in the last call."""

    def __call__(self, b: Array, before: Array | None = None, smoothness: float | None = None) -> Array:
        """The unknowns (N,) for `b` (R,), rows that are NaN left out; `smoothness` in place of the own.

        Without `before` (N,) there is no pull towards it.
        """
        seen = np.isfinite(b)
        if self._rows is None or not np.array_equal(seen, self._rows):
            self._select(seen)
        alpha = 0.0 if before is None else self._smoothness if smoothness is None else smoothness
        H = self._gram.copy()
        H.flat[:: len(H) + 1] += alpha
        f = self._seen_A.T @ b[seen] - self._cost / 2
        if before is not None:
            f += alpha * before
        w, self._sides, self.rounds = box_minimum(H, f, self._sides)
        return w

    def _select(self, rows: Mask) -> None:
        """Take only these rows of A from now on."""
        self._rows, self._seen_A = rows, np.ascontiguousarray(self._A[rows])
        self._gram = self._seen_A.T @ self._seen_A
        self._cost = self._sparsity * np.sqrt(np.einsum("ri,ri->i", self._seen_A, self._seen_A))
        self._gram.flat[:: len(self._gram) + 1] += max(RIDGE * float(np.trace(self._gram)) / len(self._gram), 1e-30)


def box_minimum(H: Array, f: Array, sides: Sides) -> tuple[Array, Sides, int]:
    """The minimum (N,) of wᵀHw / 2 - fᵀw in the box, where its unknowns are, and the number of rounds it took.

    H (N, N) is positive definite; `sides` (N,) is a guess of where each unknown is: -1 at 0, 1 at 1, 0 between.
    """
    slope_tolerance = TOLERANCE * max(float(np.abs(f).max(initial=0.0)), float(H.diagonal().max(initial=0.0)))
    fewest, patience, rounds = len(f) + 1, PATIENCE, 0
    while patience > 0:
        rounds += 1
        w, slope = _on_sides(H, f, sides)
        right = _right_sides(w, slope, sides, slope_tolerance)
        wrong = int(np.count_nonzero(right != sides))
        if not wrong:
            return np.clip(w, 0.0, 1.0), sides, rounds
        fewest, patience = (wrong, PATIENCE) if wrong < fewest else (fewest, patience - 1)
        sides = right
    w, sides, more = _descend(H, f, np.clip(w, 0.0, 1.0), slope_tolerance)
    return w, sides, rounds + more


def _descend(H: Array, f: Array, w: Array, slope_tolerance: float) -> tuple[Array, Sides, int]:
    """From w inside the box down to the minimum: an active-set method, where each round lets go of a bound or hits one.

    Slower than changing sides at once, but it never goes up and so never in circles. The rounds are bounded for a
    matrix so near to singular that rounding decides; w is in the box then too.
    """
    sides = np.where(w <= 0, -1, np.where(w >= 1, 1, 0)).astype(np.int8)
    rounds = 0
    while rounds < MOST_ROUNDS * len(w):
        rounds += 1
        aim, slope = _on_sides(H, f, sides)
        way = aim - w
        room = np.where(way < 0, w, 1 - w)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where((sides == 0) & (np.abs(way) > room), room / np.abs(way), 1.0)
        hit = int(np.argmin(share))
        w = np.clip(w + share[hit] * way, 0.0, 1.0)
        if share[hit] < 1:
            sides[hit] = -1 if way[hit] < 0 else 1
            w[hit] = float(sides[hit] > 0)
            continue
        pull = np.where(sides == 0, 0.0, slope * sides)
        if pull.max(initial=0.0) <= slope_tolerance:
            break
        sides[int(np.argmax(pull))] = 0
    return w, sides, rounds


def kkt_violation(H: Array, f: Array, w: Array) -> float:
    """How far w (N,) is from the conditions of a minimum of wᵀHw / 2 - fᵀw in the box; 0 where they hold (KKT).

    The largest of: how far w is outside the box; the slope where w is between the bounds; the slope that points out of
    a bound's way into the box.
    """
    slope = H @ w - f
    inwards = np.where(w <= 0, np.minimum(slope, 0.0), np.where(w >= 1, np.maximum(slope, 0.0), slope))
    outside = np.maximum(np.maximum(-w, w - 1), 0.0)
    return float(max(np.abs(inwards).max(initial=0.0), outside.max(initial=0.0)))


def _on_sides(H: Array, f: Array, sides: Sides) -> tuple[Array, Array]:
    """The minimum (N,) with the unknowns at their bounds as `sides` has it, the free ones anywhere; its slope (N,)."""
    w = (sides > 0).astype(float)
    free = np.flatnonzero(sides == 0)
    slope = (H[:, sides > 0].sum(axis=1) if w.any() else 0.0) - f
    if len(free):
        columns = H[:, free]
        w[free] = np.linalg.solve(columns[free], -slope[free])
        slope = slope + columns @ w[free]
    return w, slope


def _right_sides(w: Array, slope: Array, sides: Sides, slope_tolerance: float) -> Sides:
    """(N,): `sides`, but for those that are beyond a bound, or are held at one and want to leave."""
    free = sides == 0
    right = sides.copy()
    right[free & (w < -TOLERANCE)] = -1
    right[free & (w > 1 + TOLERANCE)] = 1
    right[~free & (slope * sides > slope_tolerance)] = 0
    return right
