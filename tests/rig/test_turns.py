"""Plain-number quaternions against the array routines."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget import geometry
from retarget.rig import turns
from tests.synthetic.rig import small_rig

angles = st.floats(0, math.pi) | st.floats(0, 1e-7) | st.floats(math.pi - 1e-7, math.pi)
directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: math.hypot(*v) > 0.1)


def unit(vector: tuple[float, ...]) -> tuple[float, float, float]:
    x, y, z = (c / math.hypot(*vector) for c in vector)
    return x, y, z


@given(directions, angles)
def test_a_matrix_gives_the_turn_that_made_it(direction: tuple[float, ...], angle: float) -> None:
    R = geometry.matrix_from_quat(geometry.quat_from_axis_angle(unit(direction), angle))
    turn = turns.from_matrix(R)
    assert turn[3] >= 0
    assert math.hypot(*turn) == pytest.approx(1.0)
    np.testing.assert_allclose(geometry.matrix_from_quat(turn), R, atol=1e-9)


@given(directions, angles, st.floats(0, 1))
def test_two_parts_of_a_turn_make_the_turn(direction: tuple[float, ...], angle: float, share: float) -> None:
    turn = turns.about(unit(direction), angle)
    whole = turns.multiply(turns.part(turn, share), turns.part(turn, 1 - share))
    np.testing.assert_allclose(whole, turn, atol=1e-12)
    expected = geometry.quat_from_axis_angle(unit(direction), share * angle)
    np.testing.assert_allclose(turns.part(turn, share), expected, atol=1e-12)


@given(directions, angles, directions, angles)
def test_the_product_is_that_of_the_array_routine(
    a: tuple[float, ...], alpha: float, b: tuple[float, ...], beta: float
) -> None:
    p, q = turns.about(unit(a), alpha), turns.about(unit(b), beta)
    np.testing.assert_allclose(turns.multiply(p, q), geometry.quat_multiply(p, q), atol=1e-15)


@pytest.mark.parametrize("joint", range(8))
def test_a_turner_turns_the_joint_in_the_axes_of_the_rig(joint: int) -> None:
    joints = small_rig("turned").joints
    turn = turns.about(unit((1, 2, -2)), 0.7)
    local = geometry.matrix_from_quat(turns.turner(joints, joint).local(turn))
    in_rig = turns.parent_rest(joints, joint) @ local
    np.testing.assert_allclose(in_rig, geometry.matrix_from_quat(turn) @ joints.T_rig_joint[joint, :3, :3], atol=1e-12)
