"""Head poses: known truth, jitter beside OpenVHead's solver, and what cannot be solved."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from retarget.camera.head_pose import (
    CV_TO_HOUSE,
    OPENVHEAD_MODEL,
    OPENVHEAD_POINTS,
    HeadPoseTracker,
    openvhead_pose,
    openvhead_quaternion,
)
from retarget.geometry import apply, matrix_from_quat, transform
from tests.camera import oracles

SIZE = (640, 480)
Array = np.ndarray


def face() -> Array:
    """(20, 3) [m] rigid points of a made-up face."""
    rng = np.random.default_rng(7)
    return rng.uniform([-0.07, -0.07, 0.0], [0.07, 0.07, 0.07], (20, 3))


def seen(points: Array, T_camera_head: Array) -> Array:
    """(N, 2) [px] through a pinhole whose focal length is the picture's width."""
    placed = apply(T_camera_head, points)
    pixels: Array = np.array(SIZE) / 2 + placed[:, :2] * [SIZE[0], -SIZE[0]] / -placed[:, 2:]
    return pixels


def turned(pitch: float, yaw: float, roll: float = 0.0) -> Array:
    return transform(Rotation.from_euler("xyz", [pitch, yaw, roll]).as_matrix(), [0.05, -0.03, -0.6])


@pytest.mark.parametrize("angles", [(0, 0, 0), (0.4, -0.8, 0.3), (-0.5, 1.0, 0.0), (0.0, 0.0, 3.0)])
def test_a_pose_comes_back(angles: tuple[float, float, float]) -> None:
    truth = turned(*angles)
    pose = HeadPoseTracker(face(), SIZE)(seen(face(), truth))
    assert pose is not None
    np.testing.assert_allclose(pose.T_camera_head, truth, atol=1e-5)
    np.testing.assert_allclose(matrix_from_quat(pose.quat_xyzw), truth[:3, :3], atol=1e-5)
    assert pose.error_px < 1e-2


def test_points_that_are_not_seen_are_left_out() -> None:
    truth = turned(0.1, 0.2)
    pixels = seen(face(), truth)
    pixels[5:] = np.nan
    pose = HeadPoseTracker(face(), SIZE)(pixels)
    assert pose is not None
    np.testing.assert_allclose(pose.T_camera_head, truth, atol=1e-4)


def test_a_head_that_turns_around_once_never_flips_its_quaternion() -> None:
    track = HeadPoseTracker(face(), SIZE)
    quats = []
    for roll in np.linspace(0, 2 * np.pi, 60):
        pose = track(seen(face(), turned(0.0, 0.0, float(roll))))
        assert pose is not None
        quats.append(pose.quat_xyzw)
    steps = np.sum(np.array(quats[1:]) * np.array(quats[:-1]), axis=1)
    assert steps.min() > 0.99
    np.testing.assert_allclose(quats[-1], -quats[0], atol=1e-4)


def test_too_few_points_or_points_in_one_place_give_no_pose() -> None:
    track = HeadPoseTracker(face(), SIZE)
    pixels = seen(face(), turned(0, 0))
    few = pixels.copy()
    few[3:] = np.nan
    assert track(few) is None
    assert track(np.full((20, 2), np.nan)) is None
    assert track(pixels) is not None


@pytest.mark.parametrize("angles", [(0.0, 0.0, 3.1), (0.3, -1.2, -2.0), (-0.9, 1.2, 1.5)])
def test_a_head_that_jumps_is_found_again_at_once(angles: tuple[float, float, float]) -> None:
    track = HeadPoseTracker(face(), SIZE)
    track(seen(face(), turned(0.0, 0.0)))
    pose = track(seen(face(), turned(*angles)))
    assert pose is not None
    np.testing.assert_allclose(pose.T_camera_head, turned(*angles), atol=1e-4)


def test_after_a_reset_the_answer_does_not_depend_on_what_was_before() -> None:
    pixels = seen(face(), turned(0.2, 0.3))
    fresh, used = HeadPoseTracker(face(), SIZE), HeadPoseTracker(face(), SIZE)
    used(seen(face(), turned(0.0, 0.0, 3.0)))
    used.reset()
    first, second = fresh(pixels), used(pixels)
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(first.T_camera_head, second.T_camera_head)


def test_with_noise_more_rigid_points_beat_openvheads_six_with_its_solver() -> None:
    rng = np.random.default_rng(8)
    track = HeadPoseTracker(face(), SIZE)
    ours, theirs = [], []
    all68 = np.full((68, 2), np.nan)
    model = OPENVHEAD_MODEL / 1e4  # about 0.1 mm
    for yaw in np.linspace(-0.3, 0.3, 60):
        truth = turned(0.05, float(yaw))
        pose = track(seen(face(), truth) + rng.normal(size=(20, 2)) * 0.5)
        assert pose is not None
        ours.append(Rotation.from_matrix(pose.T_camera_head[:3, :3] @ truth[:3, :3].T).magnitude())
        all68[list(OPENVHEAD_POINTS)] = seen(model, truth) + rng.normal(size=(6, 2)) * 0.5
        turn, _ = openvhead_pose(all68, SIZE)
        theirs.append(Rotation.from_matrix(CV_TO_HOUSE @ Rotation.from_rotvec(turn).as_matrix() @ truth[:3, :3].T))
    assert np.mean(ours) < 0.8 * np.mean([each.magnitude() for each in theirs])


def test_openvheads_quaternion_is_that_of_its_rotation_vector() -> None:
    rng = np.random.default_rng(9)
    for turn in rng.normal(size=(20, 3)):
        w, x, y, z = openvhead_quaternion(turn)
        np.testing.assert_allclose(matrix_from_quat([x, y, z, w]), cv2.Rodrigues(turn)[0], atol=1e-12)


def test_openvheads_quaternion_of_no_turn_is_not_a_number() -> None:
    assert np.isnan(openvhead_quaternion(np.zeros(3))[1:]).all()


def test_landmarks_that_are_not_seen_give_openvhead_no_pose() -> None:
    landmarks, _ = oracles.openvhead()
    landmarks[0, 8] = np.nan
    turn, place = openvhead_pose(landmarks[0], oracles.OPENVHEAD_SIZE)
    assert np.isnan([*turn, *place]).all()
