"""The solver against scipy's lsq_linear on random problems, and against the conditions of a minimum."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from retarget.rig.box_least_squares import BoxLeastSquares, box_minimum, kkt_violation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def problem(seed: int, rows: int, unknowns: int, rank: int | None = None) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(rows, unknowns))
    if rank is not None:
        A = rng.normal(size=(rows, rank)) @ rng.normal(size=(rank, unknowns))
    return A, A @ rng.normal(0.3, 0.8, unknowns) + rng.normal(scale=0.5, size=rows)


def cost(A: Array, b: Array, w: Array) -> float:
    return float(((A @ w - b) ** 2).sum())


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 10**6), rows=st.integers(1, 130), unknowns=st.integers(1, 55))
def test_it_finds_what_scipys_lsq_linear_finds(seed: int, rows: int, unknowns: int) -> None:
    A, b = problem(seed, rows, unknowns)
    w = BoxLeastSquares(A)(b)
    peer = lsq_linear(A, b, (0, 1), method="bvls", tol=1e-14, max_iter=2000).x
    assert w.min() >= 0
    assert w.max() <= 1
    assert cost(A, b, w) <= cost(A, b, peer) + 1e-6 * (1 + cost(A, b, peer))
    if rows >= 2 * unknowns:  # well conditioned, so that there is one answer
        np.testing.assert_allclose(w, peer, atol=1e-6)


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 10**6), rank=st.integers(1, 20))
def test_where_nothing_tells_unknowns_apart_it_is_still_at_a_minimum(seed: int, rank: int) -> None:
    A, b = problem(seed, 40, 30, rank)
    w = BoxLeastSquares(A)(b)
    assert kkt_violation(A.T @ A, A.T @ b, w) <= 1e-6 * np.abs(A.T @ b).max()


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 10**6), smoothness=st.floats(0.0, 100.0), sparsity=st.floats(0.0, 50.0), lost=st.floats(0, 0.9)
)
def test_with_all_its_terms_it_meets_the_conditions_of_a_minimum_to_1e_6(
    seed: int, smoothness: float, sparsity: float, lost: float
) -> None:
    A, b = problem(seed, 72, 52)
    rng = np.random.default_rng(seed)
    before = rng.uniform(0, 1, 52)
    b[rng.random(72) < lost] = np.nan
    w = BoxLeastSquares(A, smoothness, sparsity)(b, before)
    seen = np.isfinite(b)
    H = A[seen].T @ A[seen] + smoothness * np.eye(52)
    f = A[seen].T @ b[seen] + smoothness * before - sparsity * np.linalg.norm(A[seen], axis=0) / 2
    assert kkt_violation(H, f, w) <= 1e-6 * max(1.0, np.abs(f).max())


@given(seed=st.integers(0, 10**6))
@settings(deadline=None, max_examples=30)
def test_the_cost_with_all_its_terms_cannot_be_lowered(seed: int) -> None:
    """Straight from the definition: no random step from the answer, back in the box, makes it better."""
    A, b = problem(seed, 30, 20)
    rng = np.random.default_rng(seed)
    before = rng.uniform(0, 1, 20)

    def whole(w: Array) -> float:
        return cost(A, b, w) + 3.0 * float(((w - before) ** 2).sum()) + 2.0 * float(np.linalg.norm(A, axis=0) @ w)

    w = BoxLeastSquares(A, 3.0, 2.0)(b, before)
    for scale in (1e-3, 1e-1, 1.0):
        other = np.clip(w + rng.normal(scale=scale, size=(50, 20)), 0, 1)
        assert min(whole(o) for o in other) >= whole(w) - 1e-9


def test_rows_that_are_missing_are_left_out_and_the_guess_of_the_last_call_does_not_matter() -> None:
    A, b = problem(3, 60, 20)
    solver = BoxLeastSquares(A)
    whole = solver(b)
    gap = b.copy()
    gap[::3] = np.nan
    np.testing.assert_allclose(solver(gap), BoxLeastSquares(np.delete(A, slice(None, None, 3), 0))(gap[gap == gap]))
    np.testing.assert_allclose(solver(b), whole, atol=1e-12)


def test_with_nothing_seen_the_terms_without_data_decide() -> None:
    A, _ = problem(4, 12, 3)
    nothing = np.full(12, np.nan)
    np.testing.assert_allclose(BoxLeastSquares(A)(nothing), 0.0)
    before = np.array([0.0, 0.3, 1.0])
    np.testing.assert_allclose(BoxLeastSquares(A, 10.0, 2.0)(nothing, before), before)


def test_a_second_frame_like_the_first_takes_one_round() -> None:
    A, b = problem(5, 72, 52)
    solver = BoxLeastSquares(A, 0.1)
    w = solver(b, np.zeros(52))
    assert solver.rounds > 1
    solver(b + 1e-6, w)
    assert solver.rounds <= 2


@pytest.mark.parametrize("seed", range(5))
def test_even_a_matrix_on_the_brink_of_singular_comes_to_an_end_in_the_box(seed: int) -> None:
    A, b = problem(seed, 20, 52)
    H = A.T @ A + 1e-13 * np.eye(52)
    w, sides, _ = box_minimum(H, A.T @ b, np.zeros(52, np.int8))
    assert w.min() >= 0
    assert w.max() <= 1
    peer = lsq_linear(A, b, (0, 1), method="bvls", tol=1e-14, max_iter=2000).x
    assert cost(A, b, w) <= cost(A, b, peer) + 1e-3
    assert set(sides.tolist()) <= {-1, 0, 1}


def test_the_measure_of_a_minimum_sees_each_way_to_fail() -> None:
    H = np.eye(3)
    assert kkt_violation(H, np.array([0.5, -1.0, 3.0]), np.array([0.5, 0.0, 1.0])) == 0
    assert kkt_violation(H, np.array([0.5, -1.0, 3.0]), np.array([0.4, 0.0, 1.0])) == pytest.approx(0.1)
    assert kkt_violation(H, np.array([0.5, 0.2, 3.0]), np.array([0.5, 0.0, 1.0])) == pytest.approx(0.2)
    assert kkt_violation(H, np.array([0.5, -1.0, 0.7]), np.array([0.5, 0.0, 1.0])) == pytest.approx(0.3)
    assert kkt_violation(H, np.array([0.5, -1.0, 3.0]), np.array([0.5, 0.0, 1.5])) == pytest.approx(0.5)
