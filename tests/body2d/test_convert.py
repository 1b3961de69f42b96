"""From a folder to clips: points, people, errors and pictures."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest

from retarget.body2d import Settings, convert, convert_persons, load_card, read_poses, write_film, write_picture
from retarget.body2d.card import card_of_definitions
from retarget.body2d.convert import animate
from retarget.body2d.turns import bone_turns
from retarget.errors import InputError
from tests.body2d.oracle import frame_of, write_frames

if TYPE_CHECKING:
    from pathlib import Path

CARD = load_card("body25")
UPRIGHT = {8: (300.0, 300.0), 1: (300.0, 200.0), 0: (300.0, 150.0)}
LEANING = {8: (500.0, 300.0), 1: (600.0, 200.0), 0: (650.0, 150.0)}


def test_a_half_point_is_the_middle_of_two(tmp_path: Path) -> None:
    card = card_of_definitions("half", CARD.points, [(8, 1.5, -1, "a")])
    poses = write_frames(
        tmp_path, [frame_of({8: (0, 100), 1: (0, 0), 2: (200, 0)}), frame_of({8: (0, 100), 1: (0, 0)})]
    )
    _, angles = bone_turns(read_poses(poses), 0, card, Settings(body_orientation=0)).seen(0)
    assert angles == pytest.approx([45])  # and not at all where one of the two is missing


def test_a_point_below_the_confidence_was_not_seen(tmp_path: Path) -> None:
    poses = write_frames(tmp_path, [frame_of({8: (0, 9, 0.6), 1: (0, 0)}), frame_of({8: (0, 9, 0.59), 1: (0, 0)})])
    assert len(bone_turns(read_poses(poses), 0, CARD, Settings()).seen(0)[0]) == 1


def test_body_orientation_turns_the_root_alone(tmp_path: Path) -> None:
    recording = read_poses(write_frames(tmp_path, [frame_of(UPRIGHT)]))
    turned = bone_turns(recording, 0, CARD, Settings(body_orientation=60)).angles_deg[0, :2]
    np.testing.assert_allclose(turned, [30, 0], atol=1e-9)


def test_everybody_is_converted_in_parallel_as_alone(tmp_path: Path) -> None:
    poses = write_frames(tmp_path / "poses", [frame_of(UPRIGHT, LEANING)] * 3)
    both = convert_persons(poses, Settings(), CARD, tmp_path / "film.anim")
    assert [c.clip.bones[0].curve.values[0, 2] for c in both] == pytest.approx([0, 315])
    for person in (0, 1):
        alone = convert(poses, Settings(), CARD, person, tmp_path / "alone" / f"film_{person}.anim")
        assert (tmp_path / f"film_{person}.anim").read_bytes() == (
            tmp_path / "alone" / f"film_{person}.anim"
        ).read_bytes()
        assert alone.report.before == 6


def test_the_bounded_fit_stays_within_its_degrees(tmp_path: Path) -> None:
    sway = 0.5 * np.sin(np.arange(90) / 9)
    frames = [frame_of({8: (0.0, 100.0), 1: (100 * np.sin(a), 100 - 100 * np.cos(a))}) for a in sway.tolist()]
    recording = read_poses(write_frames(tmp_path, frames))
    converted = animate(recording, Settings(max_error_deg=0.5), CARD, 0, "a")
    assert converted.report.largest_error <= 0.5
    assert converted.report.after < 20
    assert converted.report.before == 90


def test_mended_rules_are_told(tmp_path: Path) -> None:
    recording = read_poses(write_frames(tmp_path, [frame_of({8: (0.5, 0.5), 1: (0.5, 0.4)})] * 2))
    notes = animate(recording, Settings(), CARD, 0, "a").notes
    assert any("editor curves are filled" in note for note in notes)
    assert any("16:9" in note for note in notes)
    told = animate(recording, Settings(picture_size=(640, 480)), CARD, 0, "a").notes
    assert not any("16:9" in note for note in told)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("{", "is not JSON"),
        ("[]", "people"),
        ('{"people": 3}', "people"),
        ('{"people": [{"pose_keypoints_2d": [1, 2, 3]}]}', "holds 3 numbers, and 75 were expected"),
        ('{"people": [{}]}', "holds no numbers"),
        (json.dumps({"people": [{"pose_keypoints_2d": ["a"] * 75}]}), "not a finite number"),
        ('{"people": [{"pose_keypoints_2d": [' + "NaN," * 74 + "0]}]}", "not a finite number"),
        ("[" * 100_000, "is not JSON"),
        ('{"people": []}', "Nobody was seen"),
    ],
)
def test_a_bad_file_is_one_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    (tmp_path / "film_0_keypoints.json").write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_poses(tmp_path)


def test_a_folder_without_pictures_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"holds no \*.json files"):
        read_poses(tmp_path)
    with pytest.raises(InputError, match="cannot be read"):
        read_poses(tmp_path / "nowhere")


def test_bones_never_seen_and_people_who_are_not_there_are_one_sentence(tmp_path: Path) -> None:
    recording = read_poses(write_frames(tmp_path, [frame_of({0: (1, 1)})]))
    with pytest.raises(InputError, match="No bone of 'body25' was ever seen"):
        animate(recording, Settings(), CARD, 0, "a")
    with pytest.raises(InputError, match="There is no person 1"):
        animate(recording, Settings(), CARD, 1, "a")


@pytest.mark.parametrize(
    ("definitions", "sentence"),
    [
        ([(8, 25, -1, "a")], "uses point 25"),
        ([(8, 1.3, -1, "a")], "uses point 1.3"),
        ([(8, 8, -1, "a")], "same point"),
        ([(8, 1, 4, "a")], "has parent 4"),
        ([(8, 1, 1, "a"), (1, 0, 0, "b")], "hangs on itself"),
    ],
)
def test_a_wrong_bone_is_one_sentence(definitions: list[tuple[float, float, int, str]], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        card_of_definitions("mine", CARD.points, definitions)


def test_a_card_of_ones_own_is_read(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    card = 'version = 1\nname = "mine"\npoints = ["a", "b"]\n[bones]\nx = { from = "a", to = 1, path = "x" }\n'
    path.write_text(card)
    (bone,) = load_card(path).bones
    assert (bone.name, bone.start, bone.end, bone.parent) == ("x", 0, 1, -1)
    path.write_text(card.replace('"a", to', '"c", to'))
    with pytest.raises(InputError, match="must be a point, one of a, b"):
        load_card(path)
    with pytest.raises(InputError, match="body25"):
        load_card("nothing")


def test_a_film_has_a_picture_for_every_picture(tmp_path: Path) -> None:
    frames = [frame_of(UPRIGHT, LEANING)] * 7
    recording = read_poses(write_frames(tmp_path / "poses", frames))
    assert write_film(tmp_path / "film.mp4", recording, CARD, Settings()) == 7
    film = cv2.VideoCapture(str(tmp_path / "film.mp4"))
    assert int(film.get(cv2.CAP_PROP_FRAME_COUNT)) == 7
    film.release()


def test_a_picture_shows_bones_and_nobody_where_nobody_is_sure(tmp_path: Path) -> None:
    recording = read_poses(write_frames(tmp_path / "poses", [frame_of(UPRIGHT), frame_of({})]))
    write_picture(tmp_path / "stances.png", recording, CARD, Settings(), stances=2)
    picture = cv2.imread(str(tmp_path / "stances.png"))
    assert picture is not None
    first, second = np.split(picture.astype(int), 2, axis=1)
    assert (first != first[0, 0]).any()
    assert not (second != second[0, 0]).any()
    with pytest.raises(InputError, match="as sure as"):
        write_picture(tmp_path / "none.png", replace(recording, points=recording.points * 0), CARD, Settings())
