"""Skinning against a loop over vertices; where dual quaternions differ from it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, get_args

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.geometry import apply, inverse, quat_from_axis_angle, quat_from_matrix, quat_multiply, transform
from retarget.rig.skinning import Skin, SkinningMethod
from tests.rig.tubes import make_pose, make_rig, random_joints, random_pose, random_surface, random_turns, tube

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import Pose
    from retarget.rig.model import Rig, Surface

    Array = NDArray[np.float64]

METHODS: tuple[SkinningMethod, ...] = get_args(SkinningMethod)


def random_rig(seed: int, surfaces: int = 1) -> tuple[np.random.Generator, Rig]:
    rng = np.random.default_rng(seed)
    joints = random_joints(rng, 12)
    return rng, make_rig(joints, *(random_surface(rng, 12) for _ in range(surfaces)))


def quat_to_rows(q: Array) -> Array:
    """Rotation matrix whose columns are the turned axes, by q p q*."""
    turned = [quat_multiply(quat_multiply(q, [*axis, 0]), q * [-1, -1, -1, 1])[:3] for axis in np.eye(3)]
    return np.array(turned).T


def naive(rig: Rig, surface: Surface, pose: Pose) -> Array:
    """Blend shapes and linear blend skinning, one vertex, one joint, one shape at a time, in float64."""
    T_rig_joint: list[Array] = []
    for j, parent in enumerate(rig.joints.parents):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = quat_to_rows(pose.rotations[j]), pose.translations[j]
        T_rig_joint.append(T if parent < 0 else T_rig_joint[parent] @ T)
    out = []
    for v in range(len(surface.positions)):
        p = surface.positions[v].astype(float)
        for weight, shape in zip(pose.weights, surface.shapes, strict=True):
            for at, offset in zip(shape.vertices, shape.offsets, strict=True):
                if at == v:
                    p = p + weight * offset
        total = np.zeros(4)
        for joint, weight in zip(surface.joints[v], surface.joint_weights[v], strict=True):
            total += weight * (T_rig_joint[joint] @ rig.joints.T_joint_mesh[joint] @ np.append(p, 1))
        out.append(total[:3])
    return np.array(out)


@pytest.mark.parametrize("seed", range(4))
def test_vertices_agree_with_a_loop_over_vertices_joints_and_shapes(seed: int) -> None:
    rng, rig = random_rig(seed, surfaces=3)
    skin = Skin(rig)
    for _ in range(3):
        pose = random_pose(rng, rig)
        for got, surface in zip(skin(pose).positions, rig.surfaces, strict=True):
            assert got.dtype == np.float32
            np.testing.assert_allclose(got, naive(rig, surface, pose), atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_the_rest_pose_leaves_every_vertex_where_it_was_bound(method: SkinningMethod) -> None:
    _, rig = random_rig(1, surfaces=2)
    for got, surface in zip(Skin(rig, method)(make_pose(rig)).positions, rig.surfaces, strict=True):
        np.testing.assert_allclose(got, surface.positions, atol=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_a_shape_at_zero_does_nothing_and_at_one_adds_its_offsets_to_its_vertices(method: SkinningMethod) -> None:
    _, rig = random_rig(2)
    skin, (surface,) = Skin(rig, method), rig.surfaces
    rest = skin(make_pose(rig)).positions[0]
    for b, shape in enumerate(surface.shapes):
        weights = np.zeros(len(rig.shape_names))
        np.testing.assert_array_equal(skin(make_pose(rig, weights=weights)).positions[0], rest)
        weights[b] = 1
        expected = surface.positions.copy()
        expected[shape.vertices] += shape.offsets
        np.testing.assert_allclose(skin(make_pose(rig, weights=weights)).positions[0], expected, atol=1e-7)


def test_a_shape_moves_only_the_surface_that_has_it() -> None:
    rng, rig = random_rig(3, surfaces=2)
    still = tuple(replace(s, vertices=s.vertices[:0], offsets=s.offsets[:0]) for s in rig.surfaces[1].shapes)
    rig = replace(rig, surfaces=(rig.surfaces[0], replace(rig.surfaces[1], shapes=still)))
    pose = random_pose(rng, rig)
    with_shapes, without = Skin(rig)(pose), Skin(rig)(replace(pose, weights=np.zeros(5)))
    np.testing.assert_array_equal(with_shapes.positions[1], without.positions[1])
    assert np.abs(with_shapes.positions[0] - without.positions[0]).max() > 1e-3


def naive_dual(rig: Rig, surface: Surface, pose: Pose) -> Array:
    """Dual quaternion blending by quaternion products alone, one vertex and one joint at a time (Kavan 2008)."""
    conjugate = np.array([-1.0, -1.0, -1.0, 1.0])
    turns: list[Array] = []
    shifts: list[Array] = []
    for j, parent in enumerate(rig.joints.parents):
        q, t = pose.rotations[j], pose.translations[j]
        if parent >= 0:
            above = turns[parent]
            t = shifts[parent] + quat_multiply(quat_multiply(above, [*t, 0]), above * conjugate)[:3]
            q = quat_multiply(above, q)
        turns.append(q)
        shifts.append(t)
    motions = []
    for q, t, T_rig_joint in zip(turns, shifts, rig.joints.T_rig_joint, strict=True):
        real = quat_multiply(q, quat_from_matrix(T_rig_joint[:3, :3]) * conjugate)
        back = quat_multiply(quat_multiply(real, [*T_rig_joint[:3, 3], 0]), real * conjugate)[:3]
        motions.append((real, quat_multiply([*(t - back), 0], real) / 2))
    out = []
    for v, position in enumerate(surface.positions.astype(float)):
        shares = np.bincount(surface.joints[v], surface.joint_weights[v])
        pivot = motions[np.argmax(shares)][0]
        real, dual = np.zeros(4), np.zeros(4)
        for joint, weight in enumerate(shares):
            sign = -1 if motions[joint][0] @ pivot < 0 else 1
            real, dual = real + sign * weight * motions[joint][0], dual + sign * weight * motions[joint][1]
        real, dual = real / np.linalg.norm(real), dual / np.linalg.norm(real)
        shift = 2 * quat_multiply(dual, real * conjugate)[:3]
        out.append(quat_multiply(quat_multiply(real, [*position, 0]), real * conjugate)[:3] + shift)
    return np.array(out)


@pytest.mark.parametrize("seed", range(4))
def test_dual_quaternions_agree_with_a_loop_over_vertices_and_joints(seed: int) -> None:
    rng, rig = random_rig(seed, surfaces=2)
    still = np.zeros(len(rig.shape_names))
    for spread_rad in (0.3, 3.0):
        pose = replace(random_pose(rng, rig, spread_rad), weights=still)
        for got, surface in zip(Skin(rig, "dual-quaternion")(pose).positions, rig.surfaces, strict=True):
            np.testing.assert_allclose(got, naive_dual(rig, surface, pose), atol=3e-6)


@pytest.mark.parametrize("seed", range(5))
def test_dual_quaternions_move_a_rigid_body_as_linear_skinning_does(seed: int) -> None:
    rng, rig = random_rig(seed)
    q, t = random_turns(rng, 1, 2.0)[0], rng.normal(0, 0.1, 3)
    moved = transform(quat_to_rows(q), t)
    roots = rig.joints.parents < 0
    translations, rotations = rig.joints.translations.copy(), rig.joints.rotations.copy()
    translations[roots] = apply(moved, translations[roots])
    rotations[roots] = quat_multiply(q, rotations[roots])
    pose = make_pose(rig, translations, rotations, rng.random(5))
    linear, dual = Skin(rig)(pose).positions[0], Skin(rig, "dual-quaternion")(pose).positions[0]
    np.testing.assert_allclose(dual, linear, atol=2e-7)


def test_dual_quaternions_move_vertices_of_one_joint_as_linear_skinning_does() -> None:
    rng, rig = random_rig(4)
    alone = np.zeros_like(rig.surfaces[0].joint_weights)
    alone[:, 0] = 1
    rig = replace(rig, surfaces=(replace(rig.surfaces[0], joint_weights=alone),))
    pose = random_pose(rng, rig, spread_rad=1.5)
    linear, dual = Skin(rig)(pose).positions[0], Skin(rig, "dual-quaternion")(pose).positions[0]
    np.testing.assert_allclose(dual, linear, atol=1e-6)


def radii(rig: Rig, method: SkinningMethod, twist_rad: float) -> Array:
    """Distance of the tube's vertices from its axis, when its second joint turns about it."""
    rotations = np.stack([rig.joints.rotations[0], quat_from_axis_angle([1.0, 0.0, 0.0], twist_rad)])
    positions = Skin(rig, method)(make_pose(rig, rotations=rotations)).positions[0]
    return np.hypot(positions[:, 1], positions[:, 2])


def test_a_twisted_tube_collapses_by_linear_skinning_and_keeps_its_radius_by_dual_quaternions() -> None:
    rig = tube()
    for twist_deg in (90, 150, -150, 179):
        linear, dual = (radii(rig, method, np.radians(twist_deg)) for method in METHODS)
        # Half-way, two points of the circle are averaged: what is left of the radius is cos(twist / 2).
        assert linear.min() == pytest.approx(0.05 * np.cos(np.radians(twist_deg) / 2), abs=1e-6)
        np.testing.assert_allclose(dual, 0.05, atol=1e-7)


def test_a_bent_tube_keeps_more_of_its_volume_by_dual_quaternions() -> None:
    rig = tube()
    (surface,) = rig.surfaces
    rotations = np.stack([rig.joints.rotations[0], quat_from_axis_angle([0.0, 0.0, 1.0], np.radians(120))])

    def volume(positions: NDArray[np.floating]) -> float:
        a, b, c = (positions[corner].astype(float) for corner in surface.triangles.T)
        ends = [positions[:32], positions[-32:]]
        caps = sum(
            sign * np.einsum("i,vi->", end.mean(axis=0), np.cross(end, np.roll(end, -1, axis=0))) / 6
            for sign, end in zip((-1, 1), ends, strict=True)
        )
        return abs(float(np.einsum("vi,vi->", a, np.cross(b, c)) / 6 + caps))

    rest = volume(surface.positions.astype(float))
    assert rest == pytest.approx(np.pi * 0.05**2 * 0.4, rel=0.01)
    linear, dual = (volume(Skin(rig, m)(make_pose(rig, rotations=rotations)).positions[0]) for m in METHODS)
    assert linear < 0.93 * rest
    assert abs(dual - rest) < abs(linear - rest) / 2


@pytest.mark.parametrize("root_deg", [0, 80, 170, 179.9, 190, 300])
def test_dual_quaternions_take_the_short_way_wherever_the_root_is_turned(root_deg: float) -> None:
    rig = tube()
    skin = Skin(rig, "dual-quaternion")
    bend = quat_from_axis_angle([0.0, 0.6, 0.8], 0.7)
    root = quat_from_axis_angle([0.6, 0.0, 0.8], np.radians(root_deg))
    upright = skin(make_pose(rig, rotations=np.stack([rig.joints.rotations[0], bend]))).positions[0]
    for sign in (1, -1):
        turned = skin(make_pose(rig, rotations=np.stack([sign * root, -sign * bend]))).positions[0]
        np.testing.assert_allclose(turned, upright @ quat_to_rows(root).T, atol=2e-7)


def test_dual_quaternions_are_refused_where_a_bind_matrix_has_scale() -> None:
    _, rig = random_rig(5)
    scaled = rig.joints.T_joint_mesh.copy()
    scaled[3, :3, :3] *= 1.1
    rig = replace(rig, joints=replace(rig.joints, T_joint_mesh=scaled))
    Skin(rig)
    with pytest.raises(InputError, match="binds the joint 'joint3' with scale, which needs linear skinning"):
        Skin(rig, "dual-quaternion")


def test_an_unknown_method_is_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match="no skinning method 'cubic'; there are: linear, dual-quaternion"):
        Skin(tube(), "cubic")  # type: ignore[arg-type]  # what a configuration file may hold


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_pose_that_is_not_finite_is_refused_by_the_name_of_the_joint_or_shape(value: float) -> None:
    _, rig = random_rig(6)
    skin = Skin(rig)
    translations, rotations, weights = rig.joints.translations.copy(), rig.joints.rotations.copy(), np.zeros(5)
    translations[4, 1] = rotations[7, 2] = weights[3] = value
    with pytest.raises(ValueError, match="pose of joint 'joint4' is not finite"):
        skin(make_pose(rig, translations=translations))
    with pytest.raises(ValueError, match="pose of joint 'joint7' is not finite"):
        skin(make_pose(rig, rotations=rotations))
    with pytest.raises(ValueError, match="weight of 'shape3' is not finite"):
        skin(make_pose(rig, weights=weights))


def test_a_pose_of_another_rig_is_refused() -> None:
    _, rig = random_rig(7)
    with pytest.raises(ValueError, match="has 12 joints and 5 blend shapes"):
        Skin(rig)(make_pose(tube()))


def test_joints_that_no_skin_uses_may_lack_a_bind_matrix() -> None:
    rng, rig = random_rig(8)
    unused = rig.joints.T_joint_mesh.copy()
    unused[5] = np.nan
    (surface,) = rig.surfaces
    joints = np.where(surface.joints == 5, 6, surface.joints)
    rig = replace(rig, joints=replace(rig.joints, T_joint_mesh=unused), surfaces=(replace(surface, joints=joints),))
    assert np.isfinite(Skin(rig)(random_pose(rng, rig)).positions[0]).all()


@pytest.mark.parametrize("method", METHODS)
def test_frames_are_independent_of_each_other(method: SkinningMethod) -> None:
    rng, rig = random_rig(9, surfaces=2)
    skin, poses = Skin(rig, method), [random_pose(rng, rig) for _ in range(3)]
    kept = [skin(pose) for pose in poses]
    copies = [np.concatenate([*d.positions, *d.normals]).copy() for d in kept]
    fresh = [Skin(rig, method)(pose) for pose in reversed(poses)]
    for deformed, copy, again in zip(kept, copies, reversed(fresh), strict=True):
        np.testing.assert_array_equal(np.concatenate([*deformed.positions, *deformed.normals]), copy)
        np.testing.assert_array_equal(np.concatenate([*again.positions, *again.normals]), copy)


@pytest.mark.parametrize("method", METHODS)
def test_normals_turn_with_a_rigid_motion(method: SkinningMethod) -> None:
    rig = tube()
    q = random_turns(np.random.default_rng(3), 1, 1.0)[0]
    moved = transform(quat_to_rows(q), [0.1, 0.2, 0.3])
    rest = inverse(moved) @ moved
    np.testing.assert_allclose(rest, np.eye(4), atol=1e-12)
    translations = np.stack([[0.1, 0.2, 0.3], rig.joints.translations[1]])
    deformed = Skin(rig, method)(make_pose(rig, translations, np.stack([q, rig.joints.rotations[1]])))
    np.testing.assert_allclose(deformed.normals[0], rig.surfaces[0].normals @ moved[:3, :3].T, atol=1e-5)
