"""Joints that trail: at rest with a still head, behind a moving one, with it again in the end."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget import geometry
from retarget.errors import InputError
from retarget.filters import PdGains
from retarget.rig.load import load_rig
from retarget.rig.model import Joints
from retarget.rig.posing import rest_pose
from retarget.rig.secondary import FARTHEST_RAD, SecondaryMotion
from tests.rig.test_load import RIG_TOML, face_file
from tests.synthetic.places import joint_transforms
from tests.synthetic.rig import small_rig

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from retarget.frames import Pose
    from retarget.rig.model import Rig

    Array = NDArray[np.float64]

LENGTH_M = 0.04


@cache
def rig_with_pendant(alpha: float = 0.7) -> Rig:
    """The small rig with an ear pendant of two links, hanging down; its joints have axes of their own."""
    rig = small_rig("turned")
    head = rig.joints.T_rig_joint[rig.head_joint, :3, 3]
    places = head + np.array([[0.08, 0.05, 0.0], [0.08, 0.05 - LENGTH_M, 0.0], [0.08, 0.05 - 2 * LENGTH_M, 0.0]])
    first = len(rig.joints.names)
    T_new = geometry.transform(rig.joints.T_rig_joint[:3, :3, :3], places)
    T = np.concatenate([rig.joints.T_rig_joint, T_new])
    parents = np.append(rig.joints.parents, [rig.head_joint, first, first + 1])
    T_parent_joint = geometry.inverse(T[parents]) @ T
    T_parent_joint[parents < 0] = T[parents < 0]
    joints = Joints(
        (*rig.joints.names, "pendant", "link", "end"),
        parents,
        T_parent_joint[:, :3, 3],
        geometry.quat_from_matrix(T_parent_joint[:, :3, :3]),
        T,
        geometry.inverse(T),
    )
    gains = PdGains(alpha=alpha)
    return replace(rig, joints=joints, secondary={first: gains, first + 1: gains})


def poses(rig: Rig, head: Callable[[float], Array], seconds: float, rate_hz: float = 60.0) -> list[Pose]:
    """A rig at rest whose head is carried through the room: T_world_head at each time."""
    rest = rest_pose(rig)
    times = (np.arange(round(seconds * rate_hz)) / rate_hz).tolist()
    return [replace(rest, number=i, time_s=t, T_world_head=head(t)) for i, t in enumerate(times)]


def shifted(x_m: float) -> Array:
    return geometry.transform(np.eye(3), [x_m, 1.5, 0.0])


def pendant_angle(rig: Rig, pose: Pose) -> float:
    """How far the upper link hangs to the left [rad], in the rig."""
    T = joint_transforms(rig, pose)
    a, b = (T[rig.joints.index(name), :3, 3] for name in ("pendant", "link"))
    return float(np.arctan2(b[0] - a[0], a[1] - b[1]))


def test_a_still_head_leaves_everything_at_rest() -> None:
    rig = rig_with_pendant()
    trail = SecondaryMotion(rig)
    for pose in poses(rig, lambda _: shifted(0.3), 0.5):
        moved = trail(pose)
        np.testing.assert_allclose(np.abs(np.sum(moved.rotations * pose.rotations, axis=1)), 1.0, atol=1e-12)
        np.testing.assert_array_equal(moved.translations, pose.translations)


def test_a_head_that_steps_aside_leaves_the_pendant_behind_and_it_comes_after() -> None:
    rig = rig_with_pendant()
    trail = SecondaryMotion(rig, shifted(0.0))
    path = [trail(pose) for pose in poses(rig, lambda t: shifted(0.02 * min(t / 0.1, 1.0)), 6.0)]
    angles = np.array([pendant_angle(rig, pose) for pose in path])
    assert angles.min() < -0.15  # behind, to the right, while the head goes left
    assert abs(angles[-1]) < 0.02


def test_links_keep_their_lengths_and_nothing_else_moves() -> None:
    rig = rig_with_pendant()
    trail = SecondaryMotion(rig, shifted(0.0))
    names = rig.joints.names
    for pose in poses(rig, lambda t: shifted(0.05 * np.sin(9 * t)), 1.0):
        moved = trail(pose)
        T, T_rigid = joint_transforms(rig, moved), joint_transforms(rig, pose)
        for a, b in (("pendant", "link"), ("link", "end")):
            length = np.linalg.norm(T[names.index(a), :3, 3] - T[names.index(b), :3, 3])
            assert length == pytest.approx(LENGTH_M, abs=1e-9)
        np.testing.assert_allclose(T[: names.index("pendant")], T_rigid[: names.index("pendant")], atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(moved.rotations, axis=1), 1.0)


def test_a_turn_of_the_rigs_own_head_counts_as_much_as_a_way_through_the_room() -> None:
    rig = rig_with_pendant()
    trail, rest = SecondaryMotion(rig), rest_pose(rig)
    up = rig.joints.T_rig_joint[rig.head_joint, :3, :3].T @ [0.0, 1.0, 0.0]
    for i in range(20):
        rotations = rest.rotations.copy()
        turn = geometry.quat_from_axis_angle(up, 0.02 * i)
        rotations[rig.head_joint] = geometry.quat_multiply(rest.rotations[rig.head_joint], turn)
        moved = trail(replace(rest, time_s=i / 60, rotations=rotations))
    T = joint_transforms(rig, moved)
    upper, lower = (T[rig.joints.index(name), :3, 3] for name in ("pendant", "link"))
    assert upper[2] < T[rig.head_joint, 2, 3] - 0.02  # a head that turns to its left takes its left ear back
    assert lower[2] > upper[2] + 0.003


def test_less_damping_swings_more() -> None:
    def overshoot(alpha: float) -> float:
        rig = rig_with_pendant(alpha)
        trail = SecondaryMotion(rig, shifted(0.0))
        path = [trail(pose) for pose in poses(rig, lambda t: shifted(0.02 * min(t / 0.1, 1.0)), 4.0)]
        return max(pendant_angle(rig, pose) for pose in path)

    assert overshoot(0.97) > 2 * overshoot(0.7) > 0


def test_the_size_of_the_rig_scales_the_way_and_a_leap_is_bounded() -> None:
    rig = rig_with_pendant()

    def farthest(size: float, step_m: float) -> float:
        trail = SecondaryMotion(rig, shifted(0.0), size)
        path = [trail(pose) for pose in poses(rig, lambda t: shifted(step_m * (t > 0.1)), 0.3)]
        return max(abs(pendant_angle(rig, pose)) for pose in path)

    assert farthest(2.0, 0.005) == pytest.approx(farthest(1.0, 0.01), abs=1e-9)
    assert farthest(1.0, 5.0) <= FARTHEST_RAD + 1e-9


def test_the_same_motion_at_another_rate_trails_alike() -> None:
    rig = rig_with_pendant()

    def angle_at(rate_hz: float) -> float:
        trail = SecondaryMotion(rig, shifted(0.0))
        path = [
            trail(pose) for pose in poses(rig, lambda t: shifted(0.03 * np.sin(4 * t)), 1.0 + 0.5 / rate_hz, rate_hz)
        ]
        return pendant_angle(rig, path[-1])

    assert angle_at(120.0) == pytest.approx(angle_at(60.0), abs=0.06)
    assert abs(angle_at(60.0)) > 0.1


def test_reset_lets_everything_hang_at_rest() -> None:
    rig = rig_with_pendant()
    trail = SecondaryMotion(rig, shifted(0.0))
    for pose in poses(rig, lambda t: shifted(0.5 * t), 0.3):
        trail(pose)
    trail.reset()
    assert abs(pendant_angle(rig, trail(poses(rig, lambda _: shifted(0.2), 0.1)[0]))) < 1e-9


def test_a_joint_from_which_nothing_hangs_is_refused() -> None:
    rig = rig_with_pendant()
    with pytest.raises(InputError, match=r"'end'.*nothing hangs"):
        SecondaryMotion(replace(rig, secondary={rig.joints.index("end"): PdGains()}))


def test_a_joint_without_children_hangs_by_its_vertices() -> None:
    rig = load_rig("human")
    eye = rig.joints.index("eyeLeft")
    trail = SecondaryMotion(replace(rig, secondary={eye: PdGains()}), shifted(0.0))
    path = poses(rig, lambda t: shifted(0.5 * t), 0.2)
    moved = [trail(pose) for pose in path]
    assert np.abs(moved[-1].rotations[eye] - path[-1].rotations[eye]).max() > 0.05


def test_a_rig_file_names_joints_that_trail_and_their_gains(tmp_path: Path) -> None:
    def read(text: str) -> Rig:
        file = face_file()
        file.node(0, name="fringe", translation=[0.0, 0.3, 0.1])
        file.save(tmp_path / "square.glb")
        (tmp_path / "rig.toml").write_text(RIG_TOML + text)
        return load_rig(str(tmp_path))

    rig = read("[secondary]\nfringe = { alpha = 0.9, mass = 2 }\n")
    assert rig.secondary == {rig.joints.index("fringe"): PdGains(alpha=0.9, mass=2.0)}
    for text, message in (
        ("fring = {}", "'fring'.*did you mean 'fringe'"),
        ("jaw = {}", "'jaw'.*is driven already, as jaw"),
        ("noseTip = {}", "'noseTip'.*is driven already"),
        ("fringe = { spring = 1 }", "unknown key 'spring'"),
        ("fringe = { mass = 9 }", "fringe.*kd"),
        ("fringe = { kd = 90, alpha = 0 }", "fringe.*too stiff"),
        ("fringe = 3", "must be a table"),
    ):
        with pytest.raises(InputError, match=message):
            read(f"[secondary]\n{text}\n")
