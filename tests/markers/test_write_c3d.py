"""C3D written: read again by our reader and, for what is in the bytes, by ezc3d itself."""

from __future__ import annotations

from pathlib import Path

import ezc3d
import numpy as np
import pytest

from retarget.errors import InputError
from retarget.frames import MarkerLayout
from retarget.markers.c3d import read_c3d
from retarget.markers.clip import MarkerClip
from retarget.markers.write_c3d import MAX_FRAMES, write_c3d


def clip_of(frames: int, markers: int, rate_hz: float = 120.0, first_frame: int = 1) -> MarkerClip:
    rng = np.random.default_rng(frames * 1000 + markers)
    positions = rng.uniform(-2, 2, (frames, markers, 3))
    positions[rng.random((frames, markers)) < 0.2] = np.nan
    names = tuple(f"marker number {i}" for i in range(markers))
    return MarkerClip(MarkerLayout("made", names), rate_hz, positions, Path("made.trc"), first_frame)


@pytest.mark.parametrize(
    ("frames", "markers", "rate_hz", "first_frame"),
    [(1, 1, 60.0, 1), (40, 41, 59.94, 1), (20, 300, 240.0, 17), (300, 2, 120.0, 65_000)],
)
def test_names_gaps_rate_and_first_frame_survive_a_round_trip(
    tmp_path: Path, frames: int, markers: int, rate_hz: float, first_frame: int
) -> None:
    clip, path = clip_of(frames, markers, rate_hz, first_frame), tmp_path / "made.c3d"
    write_c3d(path, clip)
    back = read_c3d(path)
    np.testing.assert_allclose(back.positions, clip.positions, atol=2e-7)
    assert back.layout.names == clip.layout.names
    assert back.rate_hz == pytest.approx(rate_hz, rel=1e-7)
    assert back.first_frame == first_frame
    assert back.notes == ()


def test_gaps_have_the_residual_minus_one_and_positions_are_millimetres(tmp_path: Path) -> None:
    clip, path = clip_of(30, 4), tmp_path / "made.c3d"
    write_c3d(path, clip)
    content = ezc3d.c3d(str(path))
    gaps = np.isnan(clip.positions).any(axis=2).T
    residuals = content["data"]["meta_points"]["residuals"][0]
    assert (residuals[gaps] == -1).all()
    assert (residuals[~gaps] == 0).all()
    assert content["parameters"]["POINT"]["UNITS"]["value"] == ["mm"]
    np.testing.assert_allclose(
        content["data"]["points"][:3, ~gaps].T, clip.positions.swapaxes(0, 1)[~gaps] * 1e3, rtol=1e-6
    )


def test_frame_number_that_no_header_can_hold_becomes_one(tmp_path: Path) -> None:
    path = tmp_path / "made.c3d"
    write_c3d(path, clip_of(10, 2, first_frame=162_734))
    assert read_c3d(path).first_frame == 1


def test_take_too_long_for_c3d_is_refused_rather_than_cut(tmp_path: Path) -> None:
    long = MarkerClip(MarkerLayout("x", ("a",)), 60.0, np.zeros((MAX_FRAMES + 1, 1, 3)), Path("x"))
    with pytest.raises(InputError, match="65536 frames do not fit"):
        write_c3d(tmp_path / "long.c3d", long)
