"""Poses of the rig that the performer mimicked: read, found, and fitted to."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from calib.calibration import Settings, calibrate
from calib.fixed import by_direction
from calib.gains import predicted, site_graph
from calib.material import Material, RangeTake
from calib.neutral import find_neutral
from calib.pairs import Pairs
from calib.reference_poses import STRENGTHS, MimickedPose, choose_strength, read_poses, rig_pose
from calib.rig_range import RigRange
from retarget.errors import InputError
from tests.calib.truth import recording
from tests.synthetic.demo_take import write_c3d
from tests.synthetic.face import face_layout
from tests.synthetic.rig import site_rests
from tests.synthetic.rom import mimicked, neutral_take, person, range_of_motion, rough

if TYPE_CHECKING:
    from pathlib import Path

    from retarget.rig.model import Rig

SHAPES = ["smile", "browsUp", "browsDown", "mouthPucker", "jawLeft", "jawForward", "noseSneerLeft+noseSneerRight"]
SITES = tuple(site_rests())
GRAPH = site_graph(SITES, np.array([*site_rests().values()]))


@pytest.mark.parametrize("spans_known", [True, False])
def test_K_comes_back_from_mimicked_poses_alone_though_the_range_of_motion_was_half_hearted(
    human: Rig, spans_known: bool
) -> None:
    rng = np.random.default_rng(21)
    layout = face_layout()
    face = person(human, layout, rng)
    take, spans = mimicked(face, rng, SHAPES)
    rough_take = rough(take, rng)
    whole = recording("poses", rough_take)
    poses = tuple(
        MimickedPose(name, whole, *span)
        if spans_known
        else MimickedPose(name, whole.part(span[0] - 0.5, span[1] + 0.5), None, None)
        for name, span in spans.items()
    )
    rom = recording("rom", rough(range_of_motion(face, rng, 60.0, only=["jawOpen"]), rng))
    still = find_neutral(recording("neutral", rough(neutral_take(face, rng), rng)))
    calibration = calibrate(Material(still, (RangeTake(rom),), poses), layout, human, Settings())
    reach = RigRange(human, calibration.face.names)
    true, found = (
        np.stack([by_direction(p.K[s]) for s in calibration.face.names], 1)
        for p in (face.performer, calibration.performer)
    )
    signs = np.stack([np.max([rig_pose(n, reach).moves * s for n in SHAPES], axis=0) > 0.003 for s in (1, -1)])
    off = np.abs(found / true - 1)[signs]
    print(f"K from {len(SHAPES)} poses: median error {100 * np.median(off):.1f} %, worst {100 * off.max():.1f} %")
    assert signs.sum() > 20
    assert np.median(off) < 0.02
    assert off.max() < 0.08
    assert calibration.strength in STRENGTHS


def pairs(K: np.ndarray, noise_m: float, rng: np.random.Generator) -> Pairs:
    seen = rng.normal(scale=0.002, size=(8, len(SITES), 3))
    rig = predicted(K, seen) + rng.normal(scale=noise_m, size=seen.shape)
    return Pairs(tuple(map(str, range(8))), seen, rig, np.ones(seen.shape[:2]))


def test_the_strength_grows_with_the_noise_of_the_poses() -> None:
    alike = np.full((2, len(SITES), 3), 0.6)
    differing = np.random.default_rng(0).uniform(0.2, 1.0, (2, len(SITES), 3))
    weak, errors = choose_strength(pairs(differing, 0.0, np.random.default_rng(1)), GRAPH, 1.0)
    strong, _ = choose_strength(pairs(alike, 0.002, np.random.default_rng(1)), GRAPH, 1.0)
    assert weak < strong
    assert len(errors) == len(STRENGTHS)


def test_a_few_poses_choose_no_strength() -> None:
    few = pairs(np.full((2, len(SITES), 3), 0.6), 0.0, np.random.default_rng(1)).only(np.arange(8) < 3)
    assert choose_strength(few, GRAPH, 1.0) == (STRENGTHS[len(STRENGTHS) // 2], [])


def test_poses_are_read_from_a_list_and_from_a_folder(human: Rig, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    take, spans = mimicked(person(human, face_layout(), rng), rng, ["smile", "browsUp"])
    write_c3d(take, tmp_path / "all.c3d")
    lines = [f'"{name}" = [{start}, {end}]' for name, (start, end) in spans.items()]
    (tmp_path / "poses.toml").write_text("\n".join(['version = 1\ntake = "all.c3d"\n[poses]', *lines]))
    listed = read_poses(str(tmp_path / "poses.toml"), None)
    assert [(pose.name, pose.start_s, pose.end_s) for pose in listed] == [(n, *s) for n, s in spans.items()]
    folder = tmp_path / "poses"
    folder.mkdir()
    write_c3d(take, folder / "smile.c3d")
    assert [pose.name for pose in read_poses(str(folder), None)] == ["smile"]
    assert read_poses(str(folder), None)[0].start_s is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('version = 2\ntake = "all.c3d"\n[poses]\nsmile = [0, 1]', "'version' on line 1 must be 1"),
        ('version = 1\ntake = "all.c3d"\n[poses]\nsmile = [1, 0]', "'smile' in [poses] on line 4 must be two times"),
        ('version = 1\ntake = "all.c3d"\n[poses]\nsmile = [0, 99]', "within the"),
        ('version = 1\ntake = "all.c3d"\n[poses]\nsmile = 3', "two numbers"),
        ('version = 1\ntake = "all.c3d"\n', "at least one pose"),
        ('version = 1\ntake = "all.c3d"\nspeed = 3\n', "unknown key 'speed'"),
        ('version = 1\ntake = "none.c3d"\n[poses]\nsmile = [0, 1]', "none.c3d"),
    ],
)
def test_a_list_with_a_mistake_is_refused_with_its_place(human: Rig, tmp_path: Path, text: str, words: str) -> None:
    rng = np.random.default_rng(3)
    take, _ = mimicked(person(human, face_layout(), rng), rng, ["smile"])
    write_c3d(take, tmp_path / "all.c3d")
    (tmp_path / "poses.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        read_poses(str(tmp_path / "poses.toml"), None)
    assert words in str(caught.value)


def test_an_empty_folder_and_a_single_take_are_no_poses(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no take in the folder"):
        read_poses(str(tmp_path), None)
    with pytest.raises(InputError, match=r"neither"):
        read_poses("smile.c3d", None)


def test_a_pose_that_the_rig_does_not_have_is_refused(human: Rig) -> None:
    with pytest.raises(InputError, match="no pose 'grin'"):
        rig_pose("grin", RigRange(human, ("lipUpper",)))
