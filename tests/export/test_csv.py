"""The table of poses, read back with numpy alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from retarget.errors import OutputError
from retarget.export.csv import PosesCsv, header
from retarget.frames import Pose

if TYPE_CHECKING:
    from pathlib import Path


def random_pose(rng: np.random.Generator, number: int) -> Pose:
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=number).as_matrix()
    T[:3, 3] = rng.normal(size=3)
    return Pose(
        number,
        number / 120,
        0.0,
        T,
        rng.normal(size=(3, 3)),
        Rotation.random(3, random_state=7).as_quat(),
        rng.random(2),
    )


def test_a_table_holds_each_pose_in_full(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    poses = [random_pose(rng, n) for n in range(5)]
    with PosesCsv(tmp_path / "poses.csv", ("neck", "head", "jaw"), ("jawOpen", "mouthClose")) as sink:
        for pose in poses:
            sink(pose)
    names = (tmp_path / "poses.csv").read_text().splitlines()[0].split(",")
    values = np.loadtxt(tmp_path / "poses.csv", delimiter=",", skiprows=1)
    column = {name: values[:, i] for i, name in enumerate(names)}
    assert len(column) == len(names) == 2 + 7 + 3 * 7 + 2
    for i, pose in enumerate(poses):
        assert column["frame"][i] == pose.number
        assert column["time_s"][i] == pytest.approx(pose.time_s, abs=1e-9)
        quat = [column[f"head.{c}"][i] for c in ("qx", "qy", "qz", "qw")]
        np.testing.assert_allclose(Rotation.from_quat(quat).as_matrix(), pose.T_world_head[:3, :3], atol=1e-7)
        np.testing.assert_allclose([column[f"jaw.t{c}"][i] for c in "xyz"], pose.translations[2], rtol=1e-8)
        np.testing.assert_allclose([column[f"jaw.q{c}"][i] for c in "xyzw"], pose.rotations[2], rtol=1e-8)
        np.testing.assert_allclose([column["jawOpen"][i], column["mouthClose"][i]], pose.weights, rtol=1e-8)


def test_the_head_joint_and_the_head_in_the_world_have_columns_of_their_own() -> None:
    names = header(("neck", "head"), ())
    assert len(set(names)) == len(names)
    assert {"head.tx", "head.local.tx", "neck.qw"} <= set(names)


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with (
        pytest.raises(OutputError, match=r"absent/poses\.csv cannot be written"),
        PosesCsv(tmp_path / "absent" / "poses.csv", (), ()),
    ):
        pass
