"""A head that coasts: known motions, and the closed form of the decay."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from retarget.geometry import quat_from_axis_angle, quat_multiply
from retarget.markers.head_motion import COAST_S, HeadMotion, small_turn, turned

AXIS = np.array([2.0, -1, 2]) / 3


def moving(rate_hz: float, seconds: float = 1.0, speed: float = 0.3, spin: float = 2.0) -> HeadMotion:
    """A head in even motion, seen for a while: `speed` [m/s] along x, `spin` [rad/s] about `AXIS`."""
    head = HeadMotion(0.0, (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    for i in range(1, round(seconds * rate_hz) + 1):
        t = i / rate_hz
        x, y, z, w = quat_from_axis_angle(AXIS, spin * t).tolist()
        head.saw(t, (x, y, z, w), (speed * t, 0.0, 0.0))
    return head


def turn_between(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    return float((Rotation.from_quat(b) * Rotation.from_quat(a).inv()).magnitude())


@pytest.mark.parametrize("rate_hz", [60, 120, 360])
def test_the_next_frame_of_an_even_motion_is_expected(rate_hz: float) -> None:
    head = moving(rate_hz)
    t = 1 + 1 / rate_hz
    expected = head.expected(t)
    assert expected is not None
    # It expects to slow down, within a frame by a fraction 1 / (2 COAST_S rate) of the way.
    slack = 1 / (2 * COAST_S * rate_hz) / rate_hz
    assert expected[1][0] == pytest.approx(0.3 * t, abs=0.3 * slack * 1.1)
    assert turn_between(tuple(quat_from_axis_angle(AXIS, 2 * t)), expected[0]) < 2 * slack * 1.1


def test_nothing_is_expected_after_a_long_silence_or_from_the_past() -> None:
    head = moving(100)
    assert head.expected(5.0) is None
    assert head.expected(0.5) is None


def test_a_coasting_head_comes_to_rest_after_its_speed_times_the_coasting_time() -> None:
    head = moving(100)
    start = head.quat
    head.coast(1.1)
    nearly = head.position[0]
    head.coast(60.0)
    assert head.position[0] == pytest.approx(0.3 + 0.3 * COAST_S, rel=1e-3)
    assert nearly == pytest.approx(head.position[0], abs=0.3 * COAST_S * 0.1)
    assert turn_between(start, head.quat) == pytest.approx(2 * COAST_S, rel=1e-3)


def test_coasting_does_not_depend_on_the_frame_rate() -> None:
    slow, fast = moving(100), moving(100)
    slow.coast(1.08)
    for i in range(1, 81):
        fast.coast(1 + i / 1000)
    np.testing.assert_allclose(slow.position, fast.position, atol=1e-12)
    np.testing.assert_allclose(slow.quat, fast.quat, atol=1e-12)


def test_time_that_stands_or_runs_backwards_moves_nothing() -> None:
    head = moving(100)
    before = head.quat, head.position
    head.coast(1.0)
    head.coast(0.3)
    assert (head.quat, head.position) == before
    head.saw(0.2, head.quat, head.position)
    assert head.time_s == 0.2


def test_a_long_silence_forgets_the_speed() -> None:
    head = moving(100)
    head.saw(3.0, (0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    head.coast(4.0)
    assert head.position == (1.0, 0.0, 0.0)


def test_products_and_turns_agree_with_the_general_ones() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        a, b = Rotation.random(2, rng=rng).as_quat()
        np.testing.assert_allclose(turned(tuple(a), tuple(b)), quat_multiply(a, b), atol=1e-12)
        small = Rotation.from_rotvec(rng.normal(size=3) * 1e-3)
        new = (small * Rotation.from_quat(a)).as_quat() * rng.choice([-1, 1])
        np.testing.assert_allclose(small_turn(tuple(a), tuple(new)), small.as_rotvec(), atol=1e-8)
