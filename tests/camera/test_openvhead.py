"""OpenVHead's chain against what its own client sent, and beside ours where we differ on purpose."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from retarget.camera import openvhead
from retarget.camera.head_pose import OPENVHEAD_MODEL, OPENVHEAD_POINTS, HeadPoseTracker
from retarget.camera.openvhead import (
    LandmarkSmoother,
    OpenVHeadChain,
    QuaternionKalman,
    receiver_position,
    second_model_rotation,
)
from tests.camera import oracles


def chain_fields() -> tuple[np.ndarray, np.ndarray]:
    """Ours and OpenVHead's own eleven numbers, (117, 11) each."""
    landmarks, messages = oracles.openvhead()
    chain = OpenVHeadChain(oracles.OPENVHEAD_SIZE)
    ours = np.array([chain(points).fields() for points in landmarks])
    return ours, np.array([[float(field) for field in message.split(":")] for message in messages])


def test_the_chain_gives_openvheads_own_117_messages_back() -> None:
    ours, theirs = chain_fields()
    np.testing.assert_allclose(ours[:, 7:], theirs[:, 7:], atol=1e-6)
    # EPnP is a closed form and a few Gauss-Newton steps: other builds of the linear algebra differ in the last digits
    np.testing.assert_allclose(ours[:, :3], theirs[:, :3], rtol=1e-6)
    np.testing.assert_allclose(ours[:, 3:7], theirs[:, 3:7], atol=1.01e-4)


def test_the_flag_that_openvhead_names_is_epnp() -> None:
    landmarks, _ = oracles.openvhead()
    seen = landmarks[60][list(OPENVHEAD_POINTS)]
    camera = np.array([[528.0, 0, 264], [0, 528, 216], [0, 0, 1]])
    answers = [
        cv2.solvePnP(OPENVHEAD_MODEL, seen, camera, None, flags=flag) for flag in (cv2.SOLVEPNP_DLS, cv2.SOLVEPNP_EPNP)
    ]
    np.testing.assert_array_equal(answers[0][1], answers[1][1])
    np.testing.assert_array_equal(answers[0][2], answers[1][2])


def test_the_scalar_gain_is_that_of_the_full_kalman_filter_over_68_states() -> None:
    rng = np.random.default_rng(1)
    identity = np.eye(68)
    state, covariance = np.zeros(68), identity
    smooth = LandmarkSmoother()
    for _ in range(20):
        points = rng.uniform(50, 400, (68, 2))
        covariance = covariance + identity
        gain = covariance @ np.linalg.inv(covariance + 10 * identity)
        state = state + gain @ (points[:, 0] - state)
        covariance = (identity - gain) @ covariance
        smooth(points)
        np.testing.assert_allclose(smooth._state[:, 0], state, rtol=1e-12)
    assert smooth._variance / 10 == pytest.approx(0.270, abs=5e-4)


def test_the_compatible_filters_start_at_zero_where_our_tracker_is_right_at_once() -> None:
    landmarks, _ = oracles.openvhead()
    theirs, _ = chain_fields()
    track = HeadPoseTracker(OPENVHEAD_MODEL, oracles.OPENVHEAD_SIZE)
    ours = [track(points[list(OPENVHEAD_POINTS)]) for points in landmarks]
    assert theirs[0, 2] > 40 * theirs[-1, 2]
    distances = [-pose.T_camera_head[2, 3] for pose in ours if pose is not None]
    assert len(distances) == 117
    assert max(distances) < 1.3 * min(distances)


def test_the_compatible_quaternion_flips_its_sign_where_ours_stays_on_its_hemisphere() -> None:
    landmarks, _ = oracles.openvhead()
    theirs, _ = chain_fields()
    track = HeadPoseTracker(OPENVHEAD_MODEL, oracles.OPENVHEAD_SIZE)
    ours = [pose.quat_xyzw for points in landmarks if (pose := track(points[list(OPENVHEAD_POINTS)])) is not None]
    assert (np.sum(theirs[1:, 3:7] * theirs[:-1, 3:7], axis=1) < 0).any()
    assert (np.sum(np.array(ours[1:]) * np.array(ours[:-1]), axis=1) > 0.9).all()


def test_a_reset_chain_repeats_itself() -> None:
    landmarks, _ = oracles.openvhead()
    chain = OpenVHeadChain(oracles.OPENVHEAD_SIZE)
    first = [chain(points).fields() for points in landmarks[:10]]
    chain.reset()
    assert [chain(points).fields() for points in landmarks[:10]] == first


def test_the_receivers_quaternion_filter_follows_the_scalar_recurrence() -> None:
    rng = np.random.default_rng(2)
    kalman = QuaternionKalman()
    state, variance = [0.0] * 4, [0.1] * 4
    for _ in range(50):
        measured = rng.normal(size=4)
        for i in range(4):
            gain = variance[i] / (variance[i] + 5e-4)
            state[i] += gain * (measured[i] - state[i])
            variance[i] = variance[i] - gain * variance[i] + 8e-3
        np.testing.assert_allclose(kalman(measured), state, rtol=1e-12)
    assert gain == pytest.approx(0.944, abs=1e-3)


def test_a_flipped_sign_takes_the_receivers_filter_through_zero() -> None:
    kalman = QuaternionKalman()
    quat = np.array([0.0, 1.0, 0.0, 0.0])
    for _ in range(20):
        kalman(quat)
    lengths = [np.linalg.norm(kalman(-quat)) for _ in range(3)]
    assert min(lengths) < 0.9
    assert lengths[-1] == pytest.approx(1.0, abs=1e-2)


def test_the_second_models_turn_is_a_product_of_quaternions_with_y_and_z_negated() -> None:
    rng = np.random.default_rng(3)
    for quat in rng.normal(size=(10, 4)):
        half = openvhead.SECOND_MODEL_HALF_TURN
        r = np.array([np.cos(half), np.sin(half), 0.0, 0.0])
        w = r[0] * quat[0] - r[1:] @ quat[1:]
        v = r[0] * quat[1:] + quat[0] * r[1:] + np.cross(r[1:], quat[1:])
        np.testing.assert_allclose(second_model_rotation(quat), [w, v[0], -v[1], -v[2]], atol=1e-12)


def test_the_receiver_negates_the_translation_and_divides_it_by_a_thousand() -> None:
    np.testing.assert_array_equal(receiver_position(np.array([100.0, -200.0, 3000.0])), [-0.1, 0.2, -3.0])
