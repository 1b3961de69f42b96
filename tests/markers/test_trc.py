"""TRC: files as other programs write them, round trips, cut and empty ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget.errors import InputError
from retarget.frames import MarkerLayout
from retarget.markers.clip import MarkerClip
from retarget.markers.trc import read_trc, write_trc

CORTEX = (
    "PathFileType\t4\t(X/Y/Z)\tC:\\takes\\sprint.trc\r\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\r\n"
    "250.00\t250.00\t         3\t2\tmm\t250.00\t1\t         3\r\n"
    "Frame#\tTime\tchin\t\t\tnose\t\t\t\r\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\r\n"
    "\r\n"
    "5\t0.000\t-104.45724\t89.31086\t1479.24023\t-56.31228\t74.74961\t1254.93811\t\r\n"
    "6\t0.004\t\t\t\t-56.00818\t74.79559\t1255.04700\t\r\n"
    "7\t0.008\t0.00000\t0.00000\t0.00000\tnan\tnan\tnan\t\r\n"
)


def clip_of(positions: np.ndarray, rate_hz: float = 120.0, first_frame: int = 1) -> MarkerClip:
    names = tuple(f"marker {i}" for i in range(positions.shape[1]))
    return MarkerClip(MarkerLayout("made", names), rate_hz, positions, Path("made.trc"), first_frame)


def test_file_of_cortex_is_read_with_its_gaps(tmp_path: Path) -> None:
    path = tmp_path / "sprint.trc"
    path.write_bytes(CORTEX.encode())
    clip = read_trc(path)
    assert clip.layout.names == ("chin", "nose")
    assert clip.rate_hz == 250.0
    assert clip.first_frame == 5
    assert clip.notes == ()
    assert np.isnan(clip.positions).all(axis=2).tolist() == [[False, False], [True, False], [True, True]]
    np.testing.assert_allclose(clip.positions[0, 0], [-0.10445724, 0.08931086, 1.47924023])


def test_file_of_opensim_without_an_empty_line_in_metres_is_read(tmp_path: Path) -> None:
    path = tmp_path / "walk.trc"
    path.write_text(CORTEX.replace("\r\n\r\n", "\r\n").replace("mm", "m").replace("\t\r\n", "\r\n"))
    np.testing.assert_allclose(read_trc(path).positions[1, 1], [-56.00818, 74.79559, 1255.047])


@given(
    st.integers(1, 6),
    st.integers(1, 5),
    st.sampled_from([24.0, 59.94, 119.88, 240.0]),
    st.integers(1, 10**6),
    st.data(),
)
def test_names_gaps_rate_and_frame_numbers_survive_a_round_trip(
    tmp_path_factory: pytest.TempPathFactory, frames: int, markers: int, rate_hz: float, first: int, data: st.DataObject
) -> None:
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    positions = rng.uniform(-3, 3, (frames, markers, 3))
    positions[rng.random((frames, markers)) < 0.3] = np.nan
    path = tmp_path_factory.getbasetemp() / "round.trc"
    write_trc(path, clip_of(positions, rate_hz, first))
    back = read_trc(path)
    np.testing.assert_allclose(back.positions, positions, atol=1e-9)
    assert back.layout.names == tuple(f"marker {i}" for i in range(markers))
    assert (back.rate_hz, back.first_frame, back.notes) == (rate_hz, first, ())


def test_frame_numbers_left_out_are_frames_in_which_nothing_was_seen(tmp_path: Path) -> None:
    path = tmp_path / "sprint.trc"
    path.write_text(CORTEX.replace("\n7\t", "\n9\t"))
    clip = read_trc(path)
    assert len(clip) == 5
    assert np.isnan(clip.positions[2:4]).all()
    assert "2 frame numbers are left out" in clip.notes[0]


def test_rows_without_rising_numbers_are_taken_in_their_order(tmp_path: Path) -> None:
    path = tmp_path / "sprint.trc"
    path.write_text(CORTEX.replace("\n7\t", "\n6\t"))
    clip = read_trc(path)
    assert len(clip) == 3
    assert "in their order" in clip.notes[0]


def test_file_cut_at_every_byte_gives_whole_frames_or_one_sentence(tmp_path: Path) -> None:
    path, whole = tmp_path / "cut.trc", CORTEX.encode()
    path.write_bytes(whole)
    expected = read_trc(path).positions
    counts = set()
    for size in range(len(whole) - 1):
        path.write_bytes(whole[:size])
        try:
            clip = read_trc(path)
        except InputError as error:
            assert str(path) in str(error)  # noqa: PT017
            continue
        counts.add(len(clip))
        np.testing.assert_array_equal(clip.positions, expected[: len(clip)])
        assert len(clip) == 3 or "The file is cut" in clip.notes[-1]
    assert counts == {1, 2, 3}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "is empty"),
        ("\r\n", "is empty"),
        ("a,b,c\n", "is no TRC file"),
        (CORTEX.replace("mm", "furlong"), "unit 'furlong'"),
        (CORTEX.replace("\t2\tmm", "\t99999999\tmm"), "damaged"),
        (CORTEX.replace("250.00\t250.00", "x\ty").replace("0.004", "?").replace("0.008", "?"), "frames a second"),
    ],
)
def test_unusable_file_is_one_sentence(tmp_path: Path, content: str, words: str) -> None:
    path = tmp_path / "bad.trc"
    path.write_text(content)
    with pytest.raises(InputError, match=words):
        read_trc(path)


def test_missing_file_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_trc(tmp_path / "none.trc")


def test_name_with_a_tab_is_refused_rather_than_shifting_all_columns(tmp_path: Path) -> None:
    clip = MarkerClip(MarkerLayout("x", ("a\tb",)), 60.0, np.zeros((1, 1, 3)), Path("x"))
    with pytest.raises(InputError, match="tab"):
        write_trc(tmp_path / "x.trc", clip)
