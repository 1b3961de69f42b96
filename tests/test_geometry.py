"""Rotations, rigid motions and fits: the axioms, behaviour near identity, and scipy beside them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from retarget import geometry as g

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

TINY_TURNS = [0.0, 1e-300, 1e-16, 1e-12, 1e-9, 1e-8, 1e-7, 3e-7, 1e-6]
HALF_TURNS = [np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1])]


@st.composite
def quats(draw: st.DrawFn) -> Array:
    """Unit quaternions: any, within 1e-7 of identity, and half turns."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    axis = rng.normal(size=3)
    kind = draw(st.sampled_from(["any", "tiny", "half"]))
    angle = {"any": rng.uniform(-np.pi, np.pi), "tiny": rng.uniform(-1e-7, 1e-7), "half": np.pi}[kind]
    return g.quat_from_axis_angle(axis / np.linalg.norm(axis), angle)


@st.composite
def motions(draw: st.DrawFn) -> Array:
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    return g.transform(g.matrix_from_quat(draw(quats())), rng.uniform(-3, 3, 3))


def same_turn(a: Array, b: Array, atol: float = 1e-12) -> None:
    np.testing.assert_allclose(g.align_hemisphere(a, b), b, atol=atol)


@given(quats(), quats(), quats())
def test_turns_form_a_group(a: Array, b: Array, c: Array) -> None:
    left, right = g.quat_multiply(g.quat_multiply(a, b), c), g.quat_multiply(a, g.quat_multiply(b, c))
    np.testing.assert_allclose(left, right, atol=1e-12)
    np.testing.assert_allclose(g.quat_multiply(a, g.IDENTITY_QUAT), a, atol=1e-15)
    np.testing.assert_allclose(g.quat_multiply(g.IDENTITY_QUAT, a), a, atol=1e-15)
    np.testing.assert_allclose(g.quat_multiply(a, g.quat_conjugate(a)), g.IDENTITY_QUAT, atol=1e-12)


@given(quats(), quats())
def test_quaternions_and_matrices_multiply_alike(a: Array, b: Array) -> None:
    product = g.matrix_from_quat(g.quat_multiply(a, b))
    np.testing.assert_allclose(product, g.matrix_from_quat(a) @ g.matrix_from_quat(b), atol=1e-12)


@given(quats())
def test_a_quaternion_survives_its_matrix(q: Array) -> None:
    back = g.quat_from_matrix(g.matrix_from_quat(q))
    assert back[3] >= 0
    same_turn(back, q, 1e-9 if abs(q[3]) < 1e-9 else 1e-12)


@given(quats())
def test_matrices_are_rotations_and_scipys(q: Array) -> None:
    R = g.matrix_from_quat(q)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)
    np.testing.assert_allclose(R, Rotation.from_quat(q).as_matrix(), atol=1e-12)


@pytest.mark.parametrize("R", [np.eye(3), *HALF_TURNS])
def test_each_of_the_four_candidates_of_shepperd_is_exact_where_it_is_the_largest(R: Array) -> None:
    q = g.quat_from_matrix(R)
    assert np.abs(q).max() == 1.0
    np.testing.assert_array_equal(g.matrix_from_quat(q), R)


@pytest.mark.parametrize("R", HALF_TURNS)
def test_near_a_half_turn_the_quaternion_keeps_its_digits(R: Array) -> None:
    turn = g.matrix_from_quat(g.quat_from_axis_angle([0.6, 0.0, 0.8], 1e-9))
    q = g.quat_from_matrix(turn @ R)
    np.testing.assert_allclose(g.matrix_from_quat(q), turn @ R, atol=1e-15)


@pytest.mark.parametrize("angle", TINY_TURNS)
def test_tiny_turns_keep_their_axis_and_angle(angle: float) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3
    q = g.quat_from_axis_angle(axis, angle)
    np.testing.assert_allclose(q[:3], axis * angle / 2, rtol=1e-12)
    np.testing.assert_allclose(g.quat_from_matrix(g.matrix_from_quat(q))[:3], q[:3], rtol=1e-6, atol=1e-17)


def test_an_axis_turn_is_scipys() -> None:
    rng = np.random.default_rng(0)
    axes = rng.normal(size=(20, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = rng.uniform(-6, 6, 20)
    same_turn(g.quat_from_axis_angle(axes, angles), Rotation.from_rotvec(axes * angles[:, None]).as_quat())


def test_functions_take_any_leading_axes_and_agree_with_a_loop() -> None:
    rng = np.random.default_rng(1)
    q = Rotation.random(12, rng=rng).as_quat().reshape(3, 4, 4)
    p = Rotation.random(4, rng=rng).as_quat()
    product, R = g.quat_multiply(q, p), g.matrix_from_quat(q)
    T = g.transform(R, rng.normal(size=3))
    for i, j in np.ndindex(3, 4):
        np.testing.assert_array_equal(product[i, j], g.quat_multiply(q[i, j], p[j]))
        np.testing.assert_array_equal(R[i, j], g.matrix_from_quat(q[i, j]))
        np.testing.assert_array_equal(g.quat_from_matrix(R)[i, j], g.quat_from_matrix(R[i, j]))
        np.testing.assert_allclose(g.inverse(T)[i, j], g.inverse(T[i, j]), atol=1e-15)
        np.testing.assert_allclose(g.slerp(q, p, 0.3)[i, j], g.slerp(q[i, j], p[j], 0.3), atol=1e-15)


@given(motions(), motions())
def test_rigid_motions_invert_and_compose(T_a_b: Array, T_b_c: Array) -> None:
    np.testing.assert_allclose(g.inverse(T_a_b) @ T_a_b, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(g.inverse(T_a_b), np.linalg.inv(T_a_b), atol=1e-9)
    p_c = np.arange(12.0).reshape(4, 3)
    np.testing.assert_allclose(g.apply(T_a_b, g.apply(T_b_c, p_c)), g.apply(T_a_b @ T_b_c, p_c), atol=1e-12)


def test_a_point_that_is_not_seen_stays_unseen_and_alone() -> None:
    T = g.transform(g.matrix_from_quat([0, 0, 0.6, 0.8]), [1, 2, 3])
    out = g.apply(T, np.array([[1, 2, 3], [np.nan, 0, 0], [0, 0, 0]]))
    np.testing.assert_array_equal(np.isnan(out).any(axis=1), [False, True, False])
    np.testing.assert_array_equal(out[2], [1, 2, 3])


@given(quats(), quats(), st.floats(0, 1))
def test_slerp_is_scipys_on_the_shorter_way(a: Array, b: Array, fraction: float) -> None:
    if abs(a @ b) < 1e-6:
        return  # opposite turns: both ways are as short
    expected = Slerp([0, 1], Rotation.from_quat([a, b]))(fraction)
    q = g.slerp(a, b, fraction)
    assert np.linalg.norm(q) == pytest.approx(1)
    assert (Rotation.from_quat(q) * expected.inv()).magnitude() < 1e-7


@pytest.mark.parametrize("angle", TINY_TURNS)
def test_slerp_between_nearly_equal_turns_is_sound(angle: float) -> None:
    b = g.quat_from_axis_angle([0.0, 1.0, 0.0], angle)
    q = g.slerp(g.IDENTITY_QUAT, -b, 0.25)
    np.testing.assert_allclose(q, g.quat_from_axis_angle([0.0, 1.0, 0.0], angle / 4), rtol=1e-6, atol=1e-15)


@given(quats(), quats())
def test_the_hemisphere_is_that_of_the_reference(q: Array, reference: Array) -> None:
    near = g.align_hemisphere(q, reference)
    assert near @ reference >= 0
    assert np.array_equal(near, q) or np.array_equal(near, -q)


@given(motions(), st.integers(3, 20), st.integers(0, 2**32))
def test_kabsch_and_umeyama_give_a_known_motion_back(T: Array, count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    p = rng.normal(size=(count, 3)) * 0.1
    if np.linalg.svd(p - p.mean(axis=0), compute_uv=False)[1] < 0.02:
        return  # on a line: the turn about it is arbitrary
    weights = rng.uniform(0.1, 1, count)
    np.testing.assert_allclose(g.kabsch(p, g.apply(T, p), weights), T, atol=1e-9)
    scaled = 0.7 * p @ T[:3, :3].T + T[:3, 3]
    found, scale = g.umeyama(p, scaled, weights)
    assert scale == pytest.approx(0.7)
    np.testing.assert_allclose(found, T, atol=1e-9)


def test_kabsch_with_noise_and_weights_is_scipys_alignment() -> None:
    rng = np.random.default_rng(2)
    for _ in range(50):
        p, weights = rng.normal(size=(8, 3)), rng.uniform(0.1, 2, 8)
        q = Rotation.random(rng=rng).apply(p) + rng.normal(size=(8, 3)) * 0.2 + 5
        centred = p - np.average(p, axis=0, weights=weights), q - np.average(q, axis=0, weights=weights)
        expected, _ = Rotation.align_vectors(centred[1], centred[0], weights=weights)
        T = g.kabsch(p, q, weights)
        np.testing.assert_allclose(T[:3, :3], expected.as_matrix(), atol=1e-9)
        np.testing.assert_allclose(
            np.average(g.apply(T, p), axis=0, weights=weights), np.average(q, axis=0, weights=weights)
        )


def test_no_small_change_of_umeyamas_answer_is_better() -> None:
    rng = np.random.default_rng(3)
    p, q, weights = rng.normal(size=(6, 3)), rng.normal(size=(6, 3)), rng.uniform(0.1, 1, 6)
    T, scale = g.umeyama(p, q, weights)

    def cost(R: Array, t: Array, s: float) -> float:
        return float((weights * ((s * p @ R.T + t - q) ** 2).sum(axis=1)).sum())

    best = cost(T[:3, :3], T[:3, 3], scale)
    for _ in range(200):
        R = Rotation.from_rotvec(rng.normal(size=3) * 1e-3).as_matrix() @ T[:3, :3]
        assert cost(R, T[:3, 3] + rng.normal(size=3) * 1e-3, scale + rng.normal() * 1e-3) > best


def test_mirrored_points_are_fitted_by_a_rotation_all_the_same() -> None:
    rng = np.random.default_rng(4)
    p = rng.normal(size=(10, 3))
    mirrored = p * [-1, 1, 1]
    T, scale = g.umeyama(p, mirrored)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)
    assert scale < 1
    centred = p - p.mean(axis=0), mirrored - mirrored.mean(axis=0)
    expected, _ = Rotation.align_vectors(centred[1], centred[0])
    np.testing.assert_allclose(T[:3, :3], expected.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(g.kabsch(p, mirrored)[:3, :3], T[:3, :3])


def test_points_in_a_plane_are_fitted_without_a_reflection() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        p = rng.normal(size=(4, 3)) * [0.1, 0.1, 0]
        T = g.transform(Rotation.random(rng=rng).as_matrix(), rng.normal(size=3))
        np.testing.assert_allclose(g.kabsch(p, g.apply(T, p)), T, atol=1e-9)


def test_a_marker_of_no_weight_has_no_say() -> None:
    rng = np.random.default_rng(6)
    p = rng.normal(size=(5, 3))
    q = p + 1
    q[4] += 50
    np.testing.assert_allclose(
        g.kabsch(p, q, np.array([1, 1, 1, 1, 0.0])), g.transform(np.eye(3), [1, 1, 1]), atol=1e-9
    )
