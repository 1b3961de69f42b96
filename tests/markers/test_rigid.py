"""The fit of the head: the plain one is Kabsch's, the robust one stands bad markers and swaps."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from retarget.geometry import apply, kabsch, quat_from_matrix
from retarget.markers import load_layout
from retarget.markers.rigid import fit_rigid, fit_robust, homogeneous, pose, squared_residuals
from tests.markers.takes import motion

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

SCALE = 0.002
CHIN = np.array([[0.0, -0.015, 0.09]])


def band() -> Array:
    markers = load_layout("face24").markers
    assert markers.rest is not None
    return markers.rest[list(markers.head)]


def skin() -> Array:
    """Nine places on the upper face."""
    rows = [[0, 150, 90], [50, 140, 80], [-50, 140, 80], [0, 90, 100], [0, 60, 120]]
    return np.array([*rows, [18, 85, 85], [55, 85, 60], [-18, 85, 85], [-55, 85, 60]]) / 1000


def chin_error(T: Array, truth: Array) -> float:
    return float(np.linalg.norm(apply(T, CHIN) - apply(truth, CHIN)))


def nearby(T: Array, rng: np.random.Generator) -> Array:
    """What one expects of a head that was seen a frame ago."""
    return T @ motion(rng, turn_rad=0.02, shift_m=0.002)


@given(st.integers(0, 2**32), st.integers(3, 12), st.floats(0, 3.1))
@settings(deadline=None)
def test_the_fast_fit_is_kabsch(seed: int, count: int, turn: float) -> None:
    rng = np.random.default_rng(seed)
    head = rng.normal(size=(count, 3)) * 0.06
    world = apply(motion(rng, turn, 3), head) + rng.normal(size=(count, 3)) * 1e-3
    weights = rng.uniform(0.2, 1, count)
    fit = fit_rigid(homogeneous(head), homogeneous(world), weights[:, None])
    spread = np.linalg.svd(head - np.average(head, axis=0, weights=weights), compute_uv=False)
    if spread[1] < 0.01:
        return  # nearly on a line: no fit is well determined
    np.testing.assert_allclose(fit.T_world_head, kabsch(head, world, weights), atol=1e-9)
    np.testing.assert_allclose(np.abs(np.dot(fit.quat, quat_from_matrix(fit.T_world_head[:3, :3]))), 1, atol=1e-12)


def test_a_pose_takes_its_point_where_it_should() -> None:
    rng = np.random.default_rng(1)
    T = motion(rng, 3)
    x, y, z, w = quat_from_matrix(T[:3, :3]).tolist()
    at = apply(T, CHIN)[0].tolist()
    np.testing.assert_allclose(pose((x, y, z, w), tuple(CHIN[0].tolist()), (at[0], at[1], at[2])), T, atol=1e-12)


def test_the_breadth_is_the_spread_about_the_best_line() -> None:
    line = np.outer(np.linspace(-1, 1, 5), [0.05, 0, 0])
    wide = line + np.array([0, 0.01, 0]) * np.array([[1], [-1], [0], [-1], [1]])
    one = np.ones((5, 1))
    assert fit_rigid(homogeneous(line), homogeneous(line), one).breadth_m < 1e-6
    breadth = fit_rigid(homogeneous(wide), homogeneous(wide), one).breadth_m
    assert breadth == pytest.approx(0.01 * np.sqrt(4 / 5), rel=1e-3)


def test_residuals_are_squared_distances() -> None:
    rng = np.random.default_rng(2)
    head, world, T = rng.normal(size=(6, 3)), rng.normal(size=(6, 3)), motion(rng)
    expected = [np.linalg.norm(w - (T[:3, :3] @ h + T[:3, 3])) ** 2 for h, w in zip(head, world, strict=True)]
    np.testing.assert_allclose(squared_residuals(T, homogeneous(head), homogeneous(world)), expected)


@pytest.mark.parametrize("head", [band(), skin()], ids=["band", "skin"])
def test_clean_markers_give_the_exact_motion_however_wrong_the_expectation(head: Array) -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        truth = motion(rng, 3, 2)
        world = homogeneous(apply(truth, head))
        for expected in (None, nearby(truth, rng), truth @ motion(rng, 0.3, 0.1)):
            fit, order = fit_robust(homogeneous(head), world, SCALE, expected)
            np.testing.assert_allclose(fit.T_world_head, truth, atol=1e-9)
            assert order is None


@pytest.mark.parametrize("head", [band(), skin()], ids=["band", "skin"])
@pytest.mark.parametrize("stray_mm", [12, 20, 50, 500])
def test_one_straying_marker_does_not_tilt_the_head(head: Array, stray_mm: float) -> None:
    rng = np.random.default_rng(4)
    robust, plain = [], []
    for i in range(100):
        truth = motion(rng, 3, 2)
        world = apply(truth, head) + rng.normal(size=head.shape) * 1e-4
        direction = rng.normal(size=3)
        world[i % len(head)] += direction / np.linalg.norm(direction) * stray_mm / 1000
        fit, _ = fit_robust(homogeneous(head), homogeneous(world), SCALE, nearby(truth, rng))
        robust.append(chin_error(fit.T_world_head, truth))
        plain.append(chin_error(kabsch(head, world), truth))
    assert max(robust) < 0.0015
    assert np.median(robust) < np.median(plain) / 8


def test_without_any_expectation_most_markers_still_outvote_one() -> None:
    rng = np.random.default_rng(5)
    head = skin()
    for i in range(100):
        truth = motion(rng, 3, 2)
        world = apply(truth, head) + rng.normal(size=head.shape) * 1e-4
        world[i % len(head)] += rng.normal(size=3) * 0.03
        fit, _ = fit_robust(homogeneous(head), homogeneous(world), SCALE)
        assert chin_error(fit.T_world_head, truth) < 0.001


def test_a_brow_that_pulls_a_third_of_the_markers_tilts_the_head_much_less_than_least_squares() -> None:
    rng = np.random.default_rng(6)
    head, truth = skin(), motion(rng)
    world = head.copy()
    world[:3] += [0, 0.008, 0.002]
    world = apply(truth, world)
    fit, _ = fit_robust(homogeneous(head), homogeneous(world), SCALE, nearby(truth, rng))
    assert chin_error(fit.T_world_head, truth) < chin_error(kabsch(head, world), truth) / 5


@pytest.mark.parametrize("order", [o for o in itertools.permutations(range(4)) if o != (0, 1, 2, 3)])
def test_every_exchange_of_names_on_a_band_is_put_right(order: tuple[int, ...]) -> None:
    rng = np.random.default_rng(7)
    # Placed askew, as one should: a symmetric band looks the same after some exchanges, with the head upside down.
    head = band() + np.array([[0, 0, 0], [25, 0, 15], [0, 0, 0], [0, 10, -20]]) / 1000
    truth = motion(rng)
    world = apply(truth, head) + rng.normal(size=head.shape) * 1e-4
    for expected in (None, nearby(truth, rng)):
        fit, found = fit_robust(homogeneous(head), homogeneous(world[list(order)]), SCALE, expected)
        assert found is not None
        np.testing.assert_array_equal(world[list(order)][list(found)], world)
        assert chin_error(fit.T_world_head, truth) < 0.001


def test_two_exchanged_markers_among_nine_are_put_right() -> None:
    rng = np.random.default_rng(8)
    head, truth = skin(), motion(rng)
    world = apply(truth, head)
    for i, j in itertools.combinations(range(9), 2):
        swapped = world.copy()
        swapped[[i, j]] = world[[j, i]]
        fit, found = fit_robust(homogeneous(head), homogeneous(swapped), SCALE, nearby(truth, rng))
        assert found is not None
        np.testing.assert_array_equal(swapped[list(found)], world)
        np.testing.assert_allclose(fit.T_world_head, truth, atol=1e-9)


def test_three_markers_are_fitted_even_if_one_is_off() -> None:
    rng = np.random.default_rng(9)
    head, truth = band()[:3], motion(rng)
    world = apply(truth, head) + rng.normal(size=(3, 3)) * 1e-3
    fit, order = fit_robust(homogeneous(head), homogeneous(world), SCALE)
    np.testing.assert_allclose(fit.T_world_head, kabsch(head, world), atol=1e-9)
    assert order is None
