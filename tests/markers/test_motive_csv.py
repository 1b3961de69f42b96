"""Motive's CSV: headers of several versions, round trips, cut and foreign files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget.errors import InputError
from retarget.frames import MarkerLayout
from retarget.markers.clip import MarkerClip
from retarget.markers.motive_csv import read_motive_csv, write_motive_csv

MOTIVE_2 = """\
Format Version,1.23,Take Name,Talk 3,Capture Frame Rate,120.000000,Export Frame Rate,60.000000,Length Units,Millimeters

,,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body Marker,Rigid Body Marker,Rigid Body Marker,Marker,Marker,Marker,Marker,Marker,Marker,Marker,Marker,Marker
,,Head,Head,Head,Head,Head:chin,Head:chin,Head:chin,Head:chin,Head:chin,Head:chin,Face:nose,Face:nose,Face:nose,Unlabeled 1042,Unlabeled 1042,Unlabeled 1042
,,1,1,1,1,2,2,2,3,3,3,4,4,4,5,5,5
,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Position,Position,Position,Position,Position,Position,Position,Position,Position
Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X,Y,Z,X,Y,Z,X,Y,Z
0,0.000000,0,0,0,1,9,9,9,1.5,2.5,3.5,10,20,30,7,7,7
1,0.016667,0,0,0,1,9,9,9,,,,11,21,31,,,
"""  # noqa: E501
MOTIVE_3 = """\
Format Version,1.25,Take Name,"Talk, 3",Capture Frame Rate,240.000000,Length Units,Meters,Coordinate Space,Global

,Type,,Marker,Marker,Marker
,Name,,chin,chin,chin
,ID,,"4CF0B31A","4CF0B31A","4CF0B31A"
,Parent,,Face,Face,Face
,,,Position,Position,Position
Frame,Time (Seconds),TimeCode,X,Y,Z
100,0.000000,15:26:46:12.02,0.1,0.2,0.3
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "take.csv"
    path.write_text(text, encoding="utf-8-sig", newline="\r\n")
    return path


def test_measured_markers_of_motive_2_are_read_and_solved_and_unlabelled_ones_left_out(tmp_path: Path) -> None:
    clip = read_motive_csv(written(tmp_path, MOTIVE_2))
    assert clip.layout.names == ("Head:chin", "Face:nose")
    assert clip.rate_hz == 60.0
    np.testing.assert_allclose(clip.positions[0], [[1.5e-3, 2.5e-3, 3.5e-3], [0.01, 0.02, 0.03]])
    assert np.isnan(clip.positions[1, 0]).all()
    assert clip.notes == ("1 columns of unlabelled markers are left out.",)


def test_time_code_column_and_parents_of_motive_3_are_no_trouble(tmp_path: Path) -> None:
    clip = read_motive_csv(written(tmp_path, MOTIVE_3))
    assert (clip.layout.names, clip.rate_hz, clip.first_frame) == (("chin",), 240.0, 100)
    np.testing.assert_allclose(clip.positions, [[[0.1, 0.2, 0.3]]])


def test_solved_markers_are_taken_with_a_note_where_there_are_no_measured_ones(tmp_path: Path) -> None:
    text = MOTIVE_2.replace(",Marker", ",Bone")
    clip = read_motive_csv(written(tmp_path, text))
    assert clip.layout.names == ("Head:chin",)
    assert "no measured markers" in clip.notes[0]


@given(st.integers(1, 6), st.integers(1, 5), st.sampled_from([24.0, 59.94, 240.0]), st.integers(0, 10**6), st.data())
def test_names_gaps_rate_and_frame_numbers_survive_a_round_trip(
    tmp_path_factory: pytest.TempPathFactory, frames: int, markers: int, rate_hz: float, first: int, data: st.DataObject
) -> None:
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    positions = rng.uniform(-3, 3, (frames, markers, 3))
    positions[rng.random((frames, markers)) < 0.3] = np.nan
    names = tuple(f'Ana:"lip, upper" {i}' for i in range(markers))
    path = tmp_path_factory.getbasetemp() / "round.csv"
    write_motive_csv(path, MarkerClip(MarkerLayout("made", names), rate_hz, positions, Path("a, b.c3d"), first))
    back = read_motive_csv(path)
    np.testing.assert_allclose(back.positions, positions, atol=1e-9)
    assert back.layout.names == names
    assert (back.rate_hz, back.first_frame, back.notes) == (rate_hz, first, ())


def test_file_cut_at_every_byte_gives_whole_frames_or_one_sentence(tmp_path: Path) -> None:
    path = written(tmp_path, MOTIVE_2)
    expected, whole = read_motive_csv(path).positions, path.read_bytes()
    counts = set()
    for size in range(len(whole) - 1):
        path.write_bytes(whole[:size])
        try:
            clip = read_motive_csv(path)
        except InputError as error:
            assert str(path) in str(error)  # noqa: PT017
            continue
        counts.add(len(clip))
        np.testing.assert_array_equal(clip.positions, expected[: len(clip)])
    assert 1 in counts


def test_file_with_fewer_frames_than_its_header_says_is_told_to_be_cut(tmp_path: Path) -> None:
    clip = read_motive_csv(written(tmp_path, MOTIVE_2.replace("Length", "Total Exported Frames,900,Length")))
    assert clip.notes[-1] == "The file is cut: it holds 2 whole frames where its header says 900."


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "is empty"),
        ("frame,time_s,head.tx\n0,0.0,1.0\n", "no CSV file exported from Motive"),
        (MOTIVE_2.replace("Frame,Time", "Picture,Time"), "no line of columns"),
        (MOTIVE_2.replace("Marker,", "Bone,").replace("Marker\n", "Bone\n"), "holds no markers"),
        (MOTIVE_2.replace("Head:chin", "Unlabeled 1").replace("Face:nose", "Unlabeled 2"), "no named markers"),
        (MOTIVE_2.replace("Millimeters", "Furlongs"), "unit 'Furlongs'"),
        (MOTIVE_2 + '"' + "x" * 200_000, "damaged"),
        (MOTIVE_2[: MOTIVE_2.index("0,0.000000")], "no frames"),
    ],
)
def test_unusable_file_is_one_sentence(tmp_path: Path, content: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_motive_csv(written(tmp_path, content))
