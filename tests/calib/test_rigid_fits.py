"""Rigid motions of many frames, against the fit of one frame and against known motion."""

from __future__ import annotations

import numpy as np

from calib.rigid_fits import into_head, residuals, rigid_fits, robust_rigid_fits, steady
from retarget import geometry

RNG = np.random.default_rng(5)
BAND = np.array([[0.06, 0.17, 0.08], [-0.07, 0.17, 0.07], [0.07, 0.18, -0.09], [-0.07, 0.17, -0.09]])


def motion(frames: int) -> np.ndarray:
    t = np.arange(frames) / 120
    turn = geometry.matrix_from_quat(geometry.quat_from_axis_angle([0.0, 0.6, 0.8], 0.3 * np.sin(2 * t)))
    return geometry.transform(turn, np.stack([0.4 + 0.05 * t, 1.5 + 0 * t, 0.02 * np.sin(3 * t)], axis=1))


def carried(T: np.ndarray, points: np.ndarray) -> np.ndarray:
    there: np.ndarray = points @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
    return there


def test_each_frame_is_fitted_as_kabsch_fits_it() -> None:
    world = carried(motion(20), BAND) + RNG.normal(scale=0.002, size=(20, 4, 3))
    weights = RNG.uniform(0.2, 1, size=(20, 4))
    fits = rigid_fits(BAND, world, weights)
    for T, p, w in zip(fits, world, weights, strict=True):
        np.testing.assert_allclose(T, geometry.kabsch(BAND, p, w), atol=1e-9)


def test_one_marker_of_four_that_strays_does_not_turn_the_head() -> None:
    T = motion(60)
    world = carried(T, BAND)
    world[:, 2] += [0.0, 0.02, 0.01]
    np.testing.assert_allclose(robust_rigid_fits(BAND, world, 0.002), T, atol=2e-4)


def test_fewer_than_three_markers_give_no_head() -> None:
    world = carried(motion(4), BAND)
    world[1, :2] = np.nan
    world[2, 0] = np.nan
    fits = robust_rigid_fits(BAND, world, 0.002)
    assert np.isnan(fits[1]).all()
    assert np.isfinite(fits[[0, 2, 3]]).all()


def test_a_pose_that_jumps_for_a_frame_is_put_right_wherever_the_head_is() -> None:
    T = motion(80)
    jumped = T.copy()
    jumped[40] = geometry.transform(geometry.matrix_from_quat([0, 0, 0.2, 0.98]), [0.4, 1.5, 0.0])
    about = BAND.mean(axis=0)
    at = carried(steady(jumped, about, 6, 2), BAND)
    np.testing.assert_allclose(at, carried(T, BAND), atol=1e-3)


def test_residuals_are_distances_and_the_way_back_is_exact() -> None:
    T = motion(5)
    np.testing.assert_allclose(residuals(T, BAND, carried(T, BAND) + np.array([0, 0, 0.003])), 0.003, atol=1e-12)
    np.testing.assert_allclose(into_head(T, carried(T, BAND)), np.broadcast_to(BAND, (5, 4, 3)), atol=1e-12)
