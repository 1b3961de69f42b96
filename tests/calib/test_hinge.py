"""The hinge of the jaw: known arcs, slides beside them, and takes that do not show it."""

from __future__ import annotations

import numpy as np
import pytest

from calib.hinge import HingeNotObservableError, fit_hinge
from calib.protrusion import jaw_motion, slides
from retarget import geometry

AXIS = geometry.matrix_from_quat([0.0, 0.03, -0.02, 1.0]) @ [1.0, 0.0, 0.0]
AXIS /= np.linalg.norm(AXIS)
PIVOT = np.array([0.0, 0.062, 0.013])
RIG_AXIS, RIG_PIVOT = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.055, 0.006])
CHINS = np.array([[0.0, -0.015, 0.09], [0.02, -0.012, 0.083], [-0.02, -0.012, 0.083]])
RATE_HZ = 120.0


def turned(angles: np.ndarray, rest: np.ndarray = CHINS) -> np.ndarray:
    R = geometry.matrix_from_quat(geometry.quat_from_axis_angle(AXIS, angles))
    path: np.ndarray = (rest - PIVOT) @ R.swapaxes(1, 2) + PIVOT
    return path


def talking(widest_deg: float = 25.0, seconds: float = 12.0) -> np.ndarray:
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    angles: np.ndarray = np.radians(widest_deg) * np.maximum(np.sin(2 * np.pi * 0.4 * t), 0.0)
    return angles


def errors(axis: np.ndarray, pivot: np.ndarray) -> tuple[float, float]:
    """Of the axis [degrees], and of where it crosses the middle of the face [m]."""
    across = pivot - PIVOT + (PIVOT[0] - pivot[0]) / axis[0] * axis
    return float(np.degrees(np.arccos(min(1.0, float(axis @ AXIS))))), float(np.linalg.norm(across))


@pytest.mark.parametrize("chins", [1, 3])
def test_a_clean_arc_gives_its_hinge_back(chins: int) -> None:
    hinge = fit_hinge(CHINS[:chins], turned(talking(), CHINS[:chins]), RATE_HZ, RIG_AXIS, RIG_PIVOT)
    degrees, metres = errors(hinge.axis, hinge.pivot)
    assert degrees < 0.1
    assert metres < 1e-4
    assert np.degrees(hinge.opening_rad) == pytest.approx(25, abs=0.3)
    assert hinge.residual_m < 1e-5


@pytest.mark.parametrize("seed", range(5))
def test_noise_gaps_and_outliers_leave_it_within_two_degrees_and_five_millimetres(seed: int) -> None:
    rng = np.random.default_rng(seed)
    path = turned(talking()) + rng.normal(scale=3e-4, size=(1440, 3, 3))
    path[rng.random((1440, 3)) < 0.1] = np.nan
    path[rng.random((1440, 3)) < 0.02] += 0.01
    hinge = fit_hinge(CHINS, path, RATE_HZ, RIG_AXIS, RIG_PIVOT)
    degrees, metres = errors(hinge.axis, hinge.pivot)
    print(f"seed {seed}: axis off by {degrees:.2f} degrees, pivot by {1e3 * metres:.2f} mm")
    assert degrees < 2
    assert metres < 0.005


def slid(angles: np.ndarray) -> np.ndarray:
    """A jaw that opens, then slides to the left by 8 mm, to the right by 6 mm, and forward by 5 mm."""
    still = np.zeros((360, 3))
    bump = np.sin(np.linspace(0, np.pi, 360))[:, None]
    ways = [still + bump * w for w in (0.008 * AXIS, -0.006 * AXIS, np.array([0.0, 0.0, 0.005]))]
    return np.concatenate([turned(angles), *(CHINS + way[:, None] for way in ways)])


def test_slides_to_the_side_and_forward_do_not_move_the_hinge() -> None:
    hinge = fit_hinge(CHINS, slid(talking()), RATE_HZ, RIG_AXIS, RIG_PIVOT)
    degrees, metres = errors(hinge.axis, hinge.pivot)
    assert degrees < 0.3
    assert metres < 0.001


def test_slides_are_measured_apart_from_the_opening() -> None:
    angles = talking()
    motion = jaw_motion(CHINS, slid(angles), AXIS, PIVOT, 2)
    seen = slides(motion, np.radians(25))
    assert (1e3 * np.array([seen.left_m, seen.right_m, seen.forward_m])).tolist() == pytest.approx([8, 6, 5], abs=0.3)
    closed = slice(len(angles), None)
    assert np.degrees(np.abs(motion.turn_rad[closed])).max() < 0.6  # what the plain angle reads for opening and closing
    assert np.degrees(motion.read_rad[closed]).min() < -1.5
    np.testing.assert_allclose(motion.turn_rad[2 : len(angles) - 2], angles[2:-2], atol=0.01)


def test_a_jaw_that_opens_and_is_pushed_forward_at_once_is_read_right() -> None:
    angles = np.full(50, np.radians(15.0))
    R = geometry.matrix_from_quat(geometry.quat_from_axis_angle([1.0, 0.0, 0.0], angles))
    path = (CHINS[:1] + np.array([0.0, 0.0, 0.006]) - PIVOT) @ R.swapaxes(1, 2) + PIVOT
    motion = jaw_motion(CHINS[:1], path, np.array([1.0, 0.0, 0.0]), PIVOT, 1)
    np.testing.assert_allclose(np.degrees(motion.turn_rad), 15.0, atol=1e-6)
    np.testing.assert_allclose(motion.forward_m, 0.006, atol=1e-9)


@pytest.mark.parametrize("widest_deg", [0.0, 1.0, 4.0])
def test_a_jaw_that_hardly_opens_was_never_exercised(widest_deg: float) -> None:
    rng = np.random.default_rng(1)
    path = turned(talking(widest_deg)) + rng.normal(scale=1e-4, size=(1440, 3, 3))
    with pytest.raises(HingeNotObservableError, match=r"never exercised, it opened by [0-4]\.[0-9] degrees"):
        fit_hinge(CHINS, path, RATE_HZ, RIG_AXIS, RIG_PIVOT)


def test_a_chin_that_is_never_seen_was_never_exercised() -> None:
    with pytest.raises(HingeNotObservableError, match="never exercised"):
        fit_hinge(CHINS, np.full((200, 3, 3), np.nan), RATE_HZ, RIG_AXIS, RIG_PIVOT)


def test_skin_that_slides_over_the_bone_keeps_the_hinge_near_the_rigs() -> None:
    """A chin whose arc is bent twice as strongly, unevenly, does not pull the hinge halfway to itself."""
    angles = talking()
    path = turned(angles)
    path += (0.006 * np.sin(4 * angles) ** 2)[:, None, None] * [0.0, 0.7, -0.7]
    hinge = fit_hinge(CHINS, path, RATE_HZ, RIG_AXIS, RIG_PIVOT)
    assert errors(hinge.axis, hinge.pivot)[1] < 0.025
    assert hinge.path_sd_m > hinge.pivot_sd_m
