"""C3D files: two real ones against a naive reader of their bytes, others written by ezc3d, damaged ones."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.markers.c3d import METRES, read_c3d, unique_labels
from retarget.markers.c3d_header import read_header
from tests.markers.takes import HEADBAND, JAW, recording, write_c3d

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray


def naive_points(data: bytes) -> NDArray[np.float64]:
    """(N, M, 4) x, y, z, residual word of an Intel file, straight from the bytes."""
    points, analog, first, last = struct.unpack_from("<4H", data, 2)
    scale, block = struct.unpack_from("<fH", data, 12)
    kind = np.dtype("<f4") if scale < 0 else np.dtype("<i2")
    frames = last - first + 1
    words = np.frombuffer(data, kind, frames * (points * 4 + analog), (block - 1) * 512)
    table = words.reshape(frames, -1)[:, : points * 4].reshape(frames, points, 4).astype(float)
    if scale > 0:
        table[..., :3] *= scale
    return table


def test_a_real_face_take_has_its_names_rate_and_positions_in_metres() -> None:
    path = recording(JAW)
    clip = read_c3d(path)
    assert (len(clip), len(clip.layout.names), clip.rate_hz) == (1590, 41, 60.0)
    assert clip.duration_s == 26.5
    assert clip.layout.names[:3] == ("ForeHead_M", "ForeHead_L", "ForeHead_R")
    assert clip.layout.name == "jaw"
    np.testing.assert_allclose(clip.positions, naive_points(path.read_bytes())[..., :3] / 1000, atol=1e-9)


def test_gaps_of_a_real_take_are_nan_exactly_where_its_residuals_are_negative() -> None:
    path = recording(HEADBAND)
    clip = read_c3d(path)
    raw = naive_points(path.read_bytes())
    markers = [i for i, name in enumerate(clip.layout.names) if not name.startswith("point ")]
    # The markers stand before the computed angles, forces, moments and powers in this file.
    unseen = raw[:, markers, 3] < 0
    assert unseen.any()
    np.testing.assert_array_equal(np.isnan(clip.positions[:, markers]).all(-1), unseen)
    np.testing.assert_array_equal(np.isnan(clip.positions[:, markers]).any(-1), unseen)


def test_a_real_take_with_the_floor_in_xy_is_turned_so_that_up_is_y() -> None:
    path = recording(HEADBAND)
    clip = read_c3d(path)
    raw = naive_points(path.read_bytes())[0, 0, :3] / 1000
    np.testing.assert_allclose(clip.positions[0, 0], [raw[0], raw[2], -raw[1]], atol=1e-7)
    head, toe = (np.nanmean(clip.positions[:, clip.layout.names.index(name)], axis=0) for name in ("RFHD", "RTOE"))
    assert head[1] - toe[1] > 1.2


def test_computed_values_of_a_real_take_are_not_taken_for_markers() -> None:
    names = read_c3d(recording(HEADBAND)).layout.names
    assert "LFHD" in names
    assert not {"LHipAngles", "LGroundReactionForce", "LKneeMoment", "LHipPower"} & set(names)


def test_only_computed_values_are_no_take(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "a.c3d", np.ones((2, 1, 3)), ["LHip"], computed=["LHip"])
    with pytest.raises(InputError, match="holds no markers"):
        read_c3d(path)


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("mm", 0.001), ("CM", 0.01), ("in", 0.0254)])
def test_units_become_metres(tmp_path: Path, unit: str, metres: float) -> None:
    positions = np.arange(1.0, 25).reshape(2, 4, 3)
    clip = read_c3d(write_c3d(tmp_path / "take.c3d", positions, list("abcd"), unit))
    np.testing.assert_allclose(clip.positions, positions * metres, rtol=1e-6)


def test_every_unit_is_a_length_in_metres_and_lower_case() -> None:
    assert all(unit == unit.casefold() and 1e-4 < metres <= 1 for unit, metres in METRES.items())


def test_an_unknown_unit_is_refused_with_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"unit 'furlong'; expected one of mm, cm"):
        read_c3d(write_c3d(tmp_path / "take.c3d", np.ones((2, 1, 3)), ["a"], "furlong"))


def test_unseen_points_are_nan_and_their_neighbours_are_not(tmp_path: Path) -> None:
    positions = np.arange(1.0, 61).reshape(5, 4, 3)
    positions[1, 2] = np.nan
    positions[3, 0] = 0.0
    clip = read_c3d(write_c3d(tmp_path / "take.c3d", positions, list("abcd"), "m"))
    expected = np.zeros((5, 4), bool)
    expected[1, 2] = expected[3, 0] = True
    np.testing.assert_array_equal(np.isnan(clip.positions).all(-1), expected)
    np.testing.assert_allclose(clip.positions[~expected], positions[~expected], rtol=1e-6)


def test_a_negative_residual_hides_its_point_wherever_that_seems_to_be(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "take.c3d", np.arange(1.0, 25).reshape(2, 4, 3), list("abcd"), "m")
    data = bytearray(path.read_bytes())
    struct.pack_into("<f", data, (read_header(path, bytes(data)).data_block - 1) * 512 + 12, -1.0)
    path.write_bytes(data)
    unseen = np.isnan(read_c3d(path).positions)
    assert unseen[0, 0].all()
    assert unseen.sum() == 3


def test_more_names_than_one_parameter_holds_are_all_found(tmp_path: Path) -> None:
    labels = [f"marker{i}" for i in range(300)]
    positions = np.random.default_rng(0).uniform(0.1, 1, (2, 300, 3))
    clip = read_c3d(write_c3d(tmp_path / "take.c3d", positions, labels, "m"))
    assert clip.layout.names == tuple(labels)
    np.testing.assert_allclose(clip.positions, positions, rtol=1e-6)


def test_equal_and_empty_names_are_made_unique_and_noted() -> None:
    names, notes = unique_labels(["chin ", "chin", "", "chin (2)"], 5)
    assert names == ["chin", "chin (3)", "point 3", "chin (2)", "point 5"]
    assert [note.split(" is ")[0] for note in notes] == ["Point 2", "Point 3", "Point 5"]


def test_a_take_longer_than_the_header_can_count_is_read_so_far_and_noted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    for frames, noted in ((65_535, 0), (65_600, 1)):
        positions = np.arange(1.0, frames + 1)[:, None, None] * np.ones(3)
        clip = read_c3d(write_c3d(tmp_path / "take.c3d", positions, ["a"], "m"))
        assert clip.positions[-1, 0, 0] == len(clip) == 65_535
        assert len(clip.notes) == len(caplog.records) == noted
    assert "goes on after frame 65534" in caplog.text


def test_up_is_taken_from_the_file_only_where_both_screen_axes_make_sense(tmp_path: Path) -> None:
    positions = np.tile([1.0, 2.0, 3.0], (2, 1, 1))
    turned = {("+X", "+Z"): [1, 3, -2], ("-Y", "+Z"): [-2, 3, -1], ("+Z", "-X"): [3, -1, -2], ("X", "Y"): [1, 2, 3]}
    senseless = {("+X", "-X"): [1, 2, 3], ("?", "+Z"): [1, 2, 3]}
    for screen, expected in (turned | senseless).items():
        clip = read_c3d(write_c3d(tmp_path / "take.c3d", positions, ["a"], "m", screen=screen))
        np.testing.assert_allclose(clip.positions[0, 0], expected, err_msg=str(screen))


def test_reading_prints_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    read_c3d(write_c3d(tmp_path / "take.c3d", np.ones((2, 1, 3)), ["a"]))
    capfd.readouterr()  # what ezc3d says while the test writes
    read_c3d(tmp_path / "take.c3d")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "is empty"),
        (b"just a text", "is not a C3D file"),
        (bytes(4096), "is not a C3D file"),
        (b"\x02\x50" + bytes(4094), "is damaged"),
    ],
)
def test_what_is_no_c3d_file_is_refused_in_a_sentence(tmp_path: Path, content: bytes, sentence: str) -> None:
    path = tmp_path / "take.c3d"
    path.write_bytes(content)
    with pytest.raises(InputError, match=sentence) as caught:
        read_c3d(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_and_a_folder_are_refused_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="There is no file"):
        read_c3d(tmp_path / "absent.c3d")
    with pytest.raises(InputError, match="cannot be read"):
        read_c3d(tmp_path)


def test_a_file_cut_anywhere_is_refused(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "take.c3d", np.ones((3, 2, 3)), ["a", "b"])
    data = path.read_bytes()
    header = read_header(path, data)
    end = (header.data_block - 1) * 512 + header.frames * header.frame_bytes
    assert end <= len(data)
    for length in range(end):
        with pytest.raises(InputError):
            read_header(path, data[:length])


def test_a_cut_take_tells_how_much_is_left(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "take.c3d", np.ones((30, 2, 3)), ["a", "b"])
    data = path.read_bytes()
    header = read_header(path, data)
    path.write_bytes(data[: (header.data_block - 1) * 512 + 12 * header.frame_bytes + 5])
    with pytest.raises(InputError, match="should hold 30 frames, but ends after 12"):
        read_c3d(path)


def test_big_endian_files_are_refused_by_name(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "take.c3d", np.ones((2, 1, 3)), ["a"])
    data = bytearray(path.read_bytes())
    data[512 + 3] = 86
    path.write_bytes(data)
    with pytest.raises(InputError, match="MIPS"):
        read_c3d(path)


def test_the_scale_of_a_dec_file_is_a_vax_number(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "take.c3d", np.ones((2, 1, 3)), ["a"])
    data = bytearray(path.read_bytes())
    data[512 + 3] = 85
    data[12:16] = bytes.fromhex("80c00000")  # -1.0 as a VAX F_floating
    assert read_header(path, bytes(data)).scale == -1.0


def test_a_file_that_makes_the_library_crash_is_refused_and_nothing_else_ends(tmp_path: Path) -> None:
    data = bytearray(recording(JAW).read_bytes())
    data[540] = 246  # in the parameter POINT:USED; ezc3d 1.7.2 ends with a segmentation fault
    path = tmp_path / "take.c3d"
    path.write_bytes(data)
    with pytest.raises(InputError, match="is damaged"):
        read_c3d(path)
