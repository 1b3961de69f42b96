"""K out of pairs: known gains, little data, contradictions, and the axes of the head."""

from __future__ import annotations

import numpy as np
import pytest

from calib.axes import refine_axes
from calib.gains import predicted, site_graph, solve_gains
from calib.pairs import Pairs
from retarget import geometry
from tests.synthetic.rig import site_rests

SITES = tuple(site_rests())
REST = np.array([*site_rests().values()])
GRAPH = site_graph(SITES, REST)
ROW = {site: i for i, site in enumerate(SITES)}


def poses(K: np.ndarray, rng: np.random.Generator, count: int = 8, noise_m: float = 0.0) -> Pairs:
    """Random poses, all sites in all directions by some millimetres."""
    seen = rng.normal(scale=0.006, size=(count, len(SITES), 3))
    rig = predicted(K, seen) + rng.normal(scale=noise_m, size=seen.shape)
    return Pairs(tuple(map(str, range(count))), seen, rig, np.ones(seen.shape[:2]))


def gains(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(0.4, 0.9, size=(2, len(SITES), 3))


def test_gains_of_every_site_axis_and_direction_come_back() -> None:
    rng = np.random.default_rng(1)
    K = gains(rng)
    found = solve_gains(poses(K, rng, 12), GRAPH, 1.0)
    off = np.abs(found.K / K - 1)
    assert np.quantile(off, 0.99) < 0.03
    assert np.median(found.confidence) > 0.97


def test_a_pose_that_went_wrong_hardly_counts() -> None:
    rng = np.random.default_rng(2)
    K = gains(rng)
    pairs = poses(K, rng, 12)
    pairs.rig[3] *= 3.0
    off = np.abs(solve_gains(pairs, GRAPH, 1.0).K / K - 1)
    assert np.median(off) < 0.01
    plain = 1e3 * np.abs(pairs.rig[3] - predicted(K, pairs.seen[3])).max()
    assert plain > 10  # [mm]: it really went wrong


def test_a_site_that_was_not_seen_takes_its_regions_value_and_one_of_a_still_region_the_default() -> None:
    pairs = poses(np.full((2, len(SITES), 3), 0.5), np.random.default_rng(3))
    unseen = [i for i, site in enumerate(SITES) if site == "browMidLeft" or site.startswith("lip")]
    pairs.weights[:, unseen] = 0.0
    found = solve_gains(pairs, GRAPH, 0.93)
    np.testing.assert_allclose(found.K[:, ROW["browMidLeft"]], 0.5, atol=0.02)
    np.testing.assert_allclose(found.K[:, ROW["lipUpper"]], 0.93, atol=1e-6)
    assert found.confidence[:, ROW["browMidLeft"]].max() == 0
    assert found.confidence[:, ROW["browInnerLeft"]].min() > 0.8


def test_down_follows_up_where_only_up_was_seen() -> None:
    K = np.full((2, len(SITES), 3), 0.6)
    pairs = poses(K, np.random.default_rng(4))
    up = Pairs(pairs.names, np.abs(pairs.seen), predicted(K, np.abs(pairs.seen)), pairs.weights)
    np.testing.assert_allclose(solve_gains(up, GRAPH, 1.0).K, 0.6, atol=0.02)


def test_where_performer_and_rig_go_opposite_ways_the_data_say_nothing() -> None:
    pairs = poses(np.full((2, len(SITES), 3), 0.5), np.random.default_rng(5))
    against = Pairs(pairs.names, pairs.seen, -pairs.rig, pairs.weights)
    found = solve_gains(against, GRAPH, 0.8)
    np.testing.assert_allclose(found.K, 0.8, atol=1e-6)
    assert found.confidence.max() == 0


def test_no_poses_give_the_default_everywhere() -> None:
    nothing = Pairs((), np.zeros((0, len(SITES), 3)), np.zeros((0, len(SITES), 3)), np.zeros((0, len(SITES))))
    np.testing.assert_allclose(solve_gains(nothing, GRAPH, 0.7).K, 0.7)
    np.testing.assert_array_equal(refine_axes(nothing, GRAPH, 0.7), np.eye(3))


def test_the_graph_is_a_laplacian_that_joins_mirrored_sites_and_never_two_regions() -> None:
    for axis, laplacian in enumerate(GRAPH):
        np.testing.assert_allclose(laplacian, laplacian.T)
        np.testing.assert_allclose(laplacian.sum(axis=0), 0.0, atol=1e-12)
        assert np.linalg.eigvalsh(laplacian).min() > -1e-9
        left, right = ROW["browMidLeft"], ROW["browMidRight"]
        other = len(SITES) if axis == 0 else 0
        assert laplacian[left, right + other] == -1
        assert laplacian[ROW["browMidLeft"], ROW["lipUpper"]] == 0


@pytest.mark.parametrize("degrees", [0.0, 2.0, 5.0])
def test_axes_of_the_head_that_are_off_are_turned_back_by_the_motion(degrees: float) -> None:
    rng = np.random.default_rng(6)
    off = geometry.matrix_from_quat(geometry.quat_from_axis_angle([0.6, 0.0, 0.8], np.radians(degrees)))
    pairs = poses(gains(rng), rng, 10, noise_m=1e-4)
    found = refine_axes(pairs.turned(off), GRAPH, 1.0)
    left = geometry.quat_from_matrix(found @ off)
    assert np.degrees(2 * np.arcsin(np.linalg.norm(left[:3]))) < 0.3


def test_one_poor_pose_does_not_turn_the_head() -> None:
    rng = np.random.default_rng(7)
    pairs = poses(gains(rng), rng, 1)
    wild = Pairs(pairs.names, pairs.seen, rng.normal(scale=0.005, size=pairs.rig.shape), pairs.weights)
    turn = geometry.quat_from_matrix(refine_axes(wild, GRAPH, 1.0))
    assert np.degrees(2 * np.arcsin(np.linalg.norm(turn[:3]))) < 8.1
