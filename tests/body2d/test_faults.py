"""Each of Video2Anim's known faults, shown mended; where its rules can be followed, beside them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.body2d import Rules, Settings, convert, load_card, read_poses
from retarget.body2d.card import card_of_definitions
from retarget.body2d.convert import animate
from retarget.body2d.turns import bone_turns
from retarget.errors import InputError
from retarget.export.unity_anim import path_hash
from tests.body2d.oracle import frame_of, write_frames

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


CARD = load_card("body25")
PLAIN = Settings(min_trembling_freq=0, mlf_max_error_ratio=0)
THEIRS = Settings(min_trembling_freq=0, mlf_max_error_ratio=0, rules=Rules.VIDEO2ANIM)


def back_at(degrees: float, confidence: float = 1.0) -> dict[str, object]:
    """Hip and neck in pixels; the back stands `degrees` counter-clockwise from upright."""
    lean = math.radians(degrees + 90)
    return frame_of({8: (300, 300, confidence), 1: (300 + 100 * math.cos(lean), 300 - 100 * math.sin(lean))})


def back_angles(poses: Path, settings: Settings) -> tuple[list[float], list[float]]:
    times_s, angles = bone_turns(read_poses(poses), 0, CARD, settings).seen(0)
    return times_s.tolist(), angles.tolist()


def test_1_editor_curves_are_filled(tmp_path: Path) -> None:
    convert(write_frames(tmp_path / "poses", [back_at(a) for a in (0, 5, 20)]), PLAIN, CARD, 0, tmp_path / "a.anim")
    text = (tmp_path / "a.anim").read_text()
    assert text.count("attribute: localEulerAnglesRaw.z") == 1
    assert "m_EditorCurves: []" not in text


def test_2_missing_folders_of_the_output_are_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pathlib import Path as RealPath

    poses = write_frames(tmp_path / "poses", [back_at(0), back_at(1)])
    monkeypatch.chdir(tmp_path)
    convert(poses, PLAIN, CARD, 0, RealPath("Animations/a.anim"))
    convert(poses, PLAIN, CARD, 0, RealPath("a.anim"))
    assert (tmp_path / "Animations/a.anim").exists()


def test_3_children_may_stand_before_their_parents() -> None:
    card = card_of_definitions("mixed", CARD.points, [(6, 7, 2, "c"), (8, 1, -1, "a"), (5, 6, 1, "b")])
    assert [bone.path for bone in card.bones] == ["a", "b", "c"]
    assert [bone.parent for bone in card.bones] == [-1, 0, 1]


def test_4_the_error_ratio_stands_alone_and_is_checked() -> None:
    assert Settings(mlf_max_error_ratio=0.3).mlf_max_error_ratio == 0.3
    with pytest.raises(InputError, match="mlf_max_error_ratio is 5; it must be a number from 0 to 1"):
        Settings(mlf_max_error_ratio=5)


def test_5_a_bone_seen_once_has_one_key(tmp_path: Path) -> None:
    poses = write_frames(tmp_path, [back_at(0, 0.1), back_at(7), back_at(0, 0.1)])
    converted = animate(read_poses(poses), PLAIN, CARD, 0, "a")
    (bone,) = converted.clip.bones
    np.testing.assert_allclose(bone.curve.values, [[0, 0, 7]], atol=1e-9)
    assert any("head" in note for note in converted.notes)
    with pytest.raises(InputError, match="'back' was seen in one picture only"):
        animate(read_poses(poses), THEIRS, CARD, 0, "a")


def test_6_pictures_are_taken_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    poses = write_frames(tmp_path, [])
    for number in (10, 2, 9, 1):
        frame = write_frames(tmp_path / "one", [back_at(number)]) / "film_000000000000_keypoints.json"
        (poses / f"film_{number}_keypoints.json").write_text(frame.read_text())
    times_s, angles = back_angles(poses, PLAIN)
    assert angles == pytest.approx([1, 2, 9, 10])
    assert times_s == pytest.approx([0, 1 / 30, 8 / 30, 9 / 30])


def test_7_all_times_count_from_the_first_detection(tmp_path: Path) -> None:
    poses = write_frames(tmp_path, [frame_of()] * 5 + [back_at(a) for a in (0, 1, 2)])
    assert back_angles(poses, PLAIN)[0] == pytest.approx([0, 1 / 30, 2 / 30])
    assert bone_turns(read_poses(poses), 0, CARD, PLAIN).start_s == pytest.approx(5 / 30)
    assert back_angles(poses, THEIRS)[0] == pytest.approx([5 / 30, 1 / 30, 2 / 30])


def test_8_no_two_keys_fall_together_at_120_pictures_a_second(tmp_path: Path) -> None:
    poses = write_frames(tmp_path / "poses", [back_at(a * a / 50) for a in range(120)])
    settings = Settings(fps=120, min_trembling_freq=0, mlf_max_error_ratio=0)
    convert(poses, settings, CARD, 0, tmp_path / "a.anim")
    euler = (tmp_path / "a.anim").read_text().split("m_PositionCurves")[0]
    written = [float(line.split(":")[1]) for line in euler.splitlines() if line.strip().startswith("time:")]
    np.testing.assert_allclose(written, np.arange(120) / 120, atol=1e-8)


def test_9_angles_are_those_of_the_picture(tmp_path: Path) -> None:
    # a limb at 45 degrees in 1280 x 720 pixels, told as parts of the picture
    limb = {8: (0.5, 0.5), 1: (0.5 + 100 / 1280, 0.5 - 100 / 720)}
    poses = write_frames(tmp_path, [frame_of(limb)] * 2)
    wide = Settings(picture_size=(1280, 720), body_orientation=0)
    assert back_angles(poses, wide)[1] == pytest.approx([45, 45])
    assert back_angles(poses, Settings(body_orientation=0))[1] == pytest.approx([45, 45])
    theirs = Settings(body_orientation=0, rules=Rules.VIDEO2ANIM)
    assert back_angles(poses, theirs)[1][0] == pytest.approx(60.6, abs=0.1)


def test_10_any_number_of_turns_is_unwrapped(tmp_path: Path) -> None:
    degrees = [20 * i for i in range(80)]
    poses = write_frames(tmp_path, [back_at(a) for a in degrees])
    assert back_angles(poses, PLAIN)[1] == pytest.approx(degrees)
    assert np.abs(np.diff(back_angles(poses, THEIRS)[1])).max() == pytest.approx(340)


def test_11_bindings_carry_the_hash_of_the_bones_own_path(tmp_path: Path) -> None:
    convert(write_frames(tmp_path / "poses", [back_at(0)] * 2), PLAIN, CARD, 0, tmp_path / "a.anim")
    text = (tmp_path / "a.anim").read_text()
    assert f"path: {path_hash('bone_1/bone_2')}" in text
    assert "134607859" not in text


def test_12_settings_may_be_given_in_any_order() -> None:
    assert Settings(min_confidence=0.5, fps=25) == Settings(fps=25, min_confidence=0.5)


def test_13_a_bone_turns_against_its_parent_however_deep(tmp_path: Path) -> None:
    turns = [30.0, -50.0, 70.0]  # back, upper arm, lower arm
    poses = write_frames(tmp_path, [arm(turns)] * 2)
    assert arm_angles(poses, PLAIN) == pytest.approx(turns)
    # against the parent's own angle, the back's turn comes twice
    assert arm_angles(poses, THEIRS) == pytest.approx([30, -50, 70 + 30])


def arm(turns: list[float]) -> dict[str, object]:
    """Each bone at its turn against the one before it, the back against upright."""
    back, upper, lower = np.radians(np.cumsum(turns) + 90)
    shoulder = np.array([200.0, 200.0])
    elbow = shoulder + 50 * np.array([np.cos(upper), -np.sin(upper)])
    wrist = elbow + 50 * np.array([np.cos(lower), -np.sin(lower)])
    neck = (300 + 100 * math.cos(back), 300 - 100 * math.sin(back))
    points: Mapping[int, tuple[float, ...]] = {8: (300.0, 300.0), 1: neck, 5: (200.0, 200.0)}
    return frame_of({**points, 6: tuple(elbow), 7: tuple(wrist)})


def arm_angles(poses: Path, settings: Settings) -> list[float]:
    """Of back, upper and lower arm, from -180 to 180."""
    angles = bone_turns(read_poses(poses), 0, CARD, settings).angles_deg[0, [0, 2, 3]]
    wrapped: list[float] = ((angles + 180) % 360 - 180).tolist()
    return wrapped
