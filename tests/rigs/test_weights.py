"""Bounded biharmonic weights on a flat sheet and on a slit one, where the answer can be reasoned out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rigs.recipe.weights import bounded_biharmonic, cotangent_laplacian, strongest, surface_distance

if TYPE_CHECKING:
    from numpy.typing import NDArray

SIDE = 21
SPACING_M = 0.002


def sheet() -> tuple[NDArray[Any], NDArray[Any]]:
    """A square of SIDE x SIDE vertices in the plane z = 0."""
    x, y = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    first = np.stack([corner, corner + 1, corner + SIDE], axis=1)
    second = np.stack([corner + 1, corner + SIDE + 1, corner + SIDE], axis=1)
    points = np.stack([x.ravel(), y.ravel(), np.zeros(SIDE * SIDE)], axis=1) * SPACING_M
    return points, np.concatenate([first, second])


def slit(triangles: NDArray[Any]) -> NDArray[Any]:
    """The sheet without the triangles between rows 10 and 11, but for the last four columns."""
    row, column = np.divmod(triangles, SIDE)
    across = (row.min(1) == 10) & (row.max(1) == 11) & (column.max(1) < SIDE - 4)
    return np.asarray(triangles[~across])


def given_at(handles: dict[int, int], count: int) -> NDArray[Any]:
    given = np.full((SIDE * SIDE, count), np.nan)
    for vertex, handle in handles.items():
        given[vertex] = np.eye(count)[handle]
    return given


def weights_between_sides() -> NDArray[Any]:
    points, triangles = sheet()
    handles = {row * SIDE: 0 for row in range(SIDE)} | {row * SIDE + SIDE - 1: 1 for row in range(SIDE)}
    return bounded_biharmonic(points, triangles, given_at(handles, 2), np.ones((SIDE * SIDE, 2)))


def test_weights_lie_between_zero_and_one_and_add_up_to_one() -> None:
    weights = weights_between_sides()
    np.testing.assert_allclose(weights.sum(1), 1)
    assert weights.min() >= 0
    assert weights.max() <= 1


def test_between_two_opposite_sides_the_weight_falls_as_the_cubic_step() -> None:
    """The bending energy with clamped ends is least for 3 t^2 - 2 t^3: no slope where a handle stands, so no crease."""
    rows = weights_between_sides()[:, 0].reshape(SIDE, SIDE)
    t = np.linspace(1, 0, SIDE)
    np.testing.assert_allclose(rows, np.tile(t * t * (3 - 2 * t), (SIDE, 1)), atol=0.005)


def test_a_handle_has_weight_one_and_the_others_zero_there() -> None:
    points, triangles = sheet()
    handles = {5 * SIDE + 5: 0, 5 * SIDE + 15: 1, 15 * SIDE + 10: 2}
    weights = bounded_biharmonic(points, triangles, given_at(handles, 3), np.ones((SIDE * SIDE, 3)))
    for vertex, handle in handles.items():
        np.testing.assert_array_equal(weights[vertex], np.eye(3)[handle])


def test_a_handle_does_not_reach_where_its_bound_is_zero() -> None:
    points, triangles = sheet()
    bound = np.ones((SIDE * SIDE, 2))
    bound[: SIDE * 8, 0] = 0
    weights = bounded_biharmonic(points, triangles, given_at({15 * SIDE + 10: 0, 2 * SIDE + 10: 1}, 2), bound)
    assert weights[: SIDE * 8, 0].max() == 0
    assert weights[10 * SIDE + 10, 0] > 0.05


def test_distance_goes_around_a_slit() -> None:
    points, triangles = sheet()
    start, opposite = np.array([10 * SIDE]), 11 * SIDE
    assert surface_distance(points, triangles, start)[opposite] == pytest.approx(SPACING_M)
    around = surface_distance(points, slit(triangles), start)[opposite]
    assert around > 2 * (SIDE - 6) * SPACING_M


def test_linear_functions_are_harmonic_inside_the_sheet() -> None:
    points, triangles = sheet()
    stiffness, area = cotangent_laplacian(points, triangles)
    inside = np.ones((SIDE, SIDE), dtype=bool)
    inside[[0, -1]] = inside[:, [0, -1]] = False
    residual = stiffness @ (2 * points[:, 0] - 3 * points[:, 1] + 1)
    assert np.abs(residual[inside.ravel()]).max() < 1e-9
    assert area.sum() == pytest.approx(((SIDE - 1) * SPACING_M) ** 2)


def test_pruned_weights_do_not_jump_where_two_joints_change_places() -> None:
    before = np.array([[0.4, 0.3, 0.2, 0.0501, 0.0499]])
    after = np.array([[0.4, 0.3, 0.2, 0.0499, 0.0501]])
    spread = []
    for weights in (before, after):
        joints, kept = strongest(weights, 4)
        assert kept.sum() == pytest.approx(1)
        whole = np.zeros(5)
        whole[joints[0]] = kept[0]
        spread.append(whole)
    np.testing.assert_allclose(spread[0], spread[1], atol=1e-3)
