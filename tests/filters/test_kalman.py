"""The Kalman filters against the textbook's matrices, and against the two that OpenVHead runs."""

from __future__ import annotations

import numpy as np
import pytest

from retarget.filters import Kalman, VelocityKalman


def test_without_limits_on_what_it_knows_the_gain_is_that_of_openvheads_landmarks() -> None:
    """Q = 1, R = 10, P0 = 1, x0 = 0, the prediction first: worked here with matrices, as OpenVHead has them."""
    rng = np.random.default_rng(0)
    landmarks = rng.uniform(0, 300, (40, 68))
    x, P, eye = np.zeros(68), np.eye(68), np.eye(68)
    ours = Kalman(1.0, 10.0, per="sample", start=0.0, start_variance=2.0)
    for i, z in enumerate(landmarks):
        P = P + eye
        gain = P @ np.linalg.inv(P + 10 * eye)
        x = x + gain @ (z - x)
        P = (eye - gain) @ P
        np.testing.assert_allclose(ours(z, 7.0 + i), x, atol=1e-9)
    assert gain[0, 0] == pytest.approx(0.270, abs=5e-4)


def test_openvheads_quaternion_filter_comes_out_number_by_number() -> None:
    """K = P / (P + R); X += K (z - X); P = P - K P + Q, with Q = 8e-3, R = 5e-4, X0 = 0, P0 = 0.1."""
    rng = np.random.default_rng(1)
    X, P = np.zeros(4), 0.1
    ours = Kalman(8e-3, 5e-4, per="sample", start=0.0, start_variance=0.1)
    for i, z in enumerate(rng.normal(size=(50, 4))):
        K = P / (P + 5e-4)
        X = X + K * (z - X)
        P = P - K * P + 8e-3
        np.testing.assert_allclose(ours(z, i / 60), X, atol=1e-12)
    assert abs(K - 0.944) < 5e-4


def test_a_filter_that_starts_from_nothing_takes_the_first_sample_as_it_is() -> None:
    """On purpose unlike OpenVHead, whose filters start at zero and need some ten frames to arrive."""
    first = np.array([67.5, -3.0])
    np.testing.assert_array_equal(Kalman(1.0, 10.0)(first, 0.0), first)
    assert Kalman(1.0, 10.0, per="sample", start=0.0, start_variance=2.0)(first, 0.0)[0] < 0.2 * first[0]


def test_variance_grows_with_the_time_and_not_with_the_samples() -> None:
    lost, all_there = Kalman(0.5, 1e-2), Kalman(0.5, 1e-2)
    for i in range(100):
        all_there(np.zeros(1), i / 60)
        lost(np.zeros(1), i / 60)
    soon = all_there(np.ones(1), 100 / 60)
    late = lost(np.ones(1), 130 / 60)
    assert soon[0] < late[0] < 1


def test_the_filter_with_a_speed_is_the_textbooks() -> None:
    rng = np.random.default_rng(2)
    times = np.cumsum(rng.uniform(0.005, 0.05, 60))
    values = rng.normal(size=60)
    process, noise = 30.0, 1e-2
    ours = VelocityKalman(process, noise, start_speed=2.0)
    x, P, H = np.array([values[0], 0.0]), np.diag([noise, 4.0]), np.array([[1.0, 0.0]])
    np.testing.assert_allclose(ours(values[:1], times[0]), values[:1])
    for dt, z, t in zip(np.diff(times), values[1:], times[1:].tolist(), strict=True):
        F = np.array([[1, dt], [0, 1]])
        Q = process * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        x, P = F @ x, F @ P @ F.T + Q
        gain = (P @ H.T) / (H @ P @ H.T + noise)
        x, P = x + gain[:, 0] * (z - x[0]), (np.eye(2) - gain @ H) @ P
        np.testing.assert_allclose(ours(np.array([z]), t), x[:1], atol=1e-10)


def test_a_steady_ramp_is_followed_without_lag() -> None:
    ours = VelocityKalman(30.0, 1e-4)
    times = np.arange(240) / 120
    smooth = [ours(np.array([3 * t]), t)[0] for t in times.tolist()]
    np.testing.assert_allclose(smooth[60:], 3 * times[60:], atol=1e-3)
