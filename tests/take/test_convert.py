"""Conversions: what goes all the way round comes back as it was."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from retarget.errors import InputError, OutputError
from retarget.frames import MarkerLayout
from retarget.markers.clip import MarkerClip
from retarget.markers.write_c3d import write_c3d
from retarget.take.convert import TARGETS, convert, read_clip, write_take
from retarget.take.decode import clip_of, frames
from retarget.take.metadata import TakeMetadata
from retarget.take.reader import read_take
from tests.take.sessions import SHARED, made_up, motive_session


def made_clip(tmp_path: Path, frames_: int = 50, markers: int = 6) -> tuple[Path, MarkerClip]:
    rng = np.random.default_rng(8)
    positions = rng.uniform(-1, 1, (frames_, markers, 3))
    positions[rng.random((frames_, markers)) < 0.2] = np.nan
    positions[20] = np.nan
    clip = MarkerClip(MarkerLayout("talk", tuple(f"m{i}" for i in range(markers))), 59.94, positions, Path("talk"), 17)
    write_c3d(tmp_path / "talk.c3d", clip)
    return tmp_path / "talk.c3d", clip


def test_clip_survives_the_way_through_every_format(tmp_path: Path) -> None:
    source, clip = made_clip(tmp_path)
    way = ["a.mcap", "b.pcapng", "c.mcap", "d.trc", "e.csv", "f.pcapng", "g.csv", "h.trc", "i.mcap", "j.c3d"]
    for here, there in pairwise([source, *(tmp_path / name for name in way)]):
        convert(here, there)
    back = read_clip(tmp_path / "j.c3d")
    np.testing.assert_allclose(back.positions, clip.positions, atol=1e-6)
    assert back.layout.names == clip.layout.names
    assert back.rate_hz == pytest.approx(59.94, rel=1e-6)
    assert back.first_frame == 17


def test_real_face_take_becomes_a_session_with_its_times_and_names(tmp_path: Path) -> None:
    jaw = SHARED / "animface/jaw.c3d"
    if not jaw.exists():
        pytest.skip("jaw.c3d is not beside the project")
    convert(jaw, tmp_path / "jaw.pcapng")
    clip, found = read_clip(jaw), list(frames(read_take(tmp_path / "jaw.pcapng")))
    assert len(found) == len(clip) == 1590
    assert found[0].layout.names == clip.layout.names
    np.testing.assert_allclose([f.time_s for f in found], np.arange(1590) / 60.0, atol=1e-8)
    np.testing.assert_allclose([f.positions for f in found], clip.positions, atol=2e-7)


def test_real_session_becomes_tables_with_its_frame_numbers(tmp_path: Path) -> None:
    session = motive_session()
    expected = clip_of(read_take(session))
    for name in ("session.trc", "session.csv", "session.c3d"):
        done = convert(session, tmp_path / name)
        clip = read_clip(tmp_path / name)
        np.testing.assert_allclose(clip.positions, expected.positions, atol=2e-7)
        assert (done.count, done.unit, clip.rate_hz) == (518, "frames", 120.0)
        assert clip.first_frame == (1 if name.endswith("c3d") else 162734)
    assert done.notes[-1] == "C3D cannot number frames up to 163251; there they start with 1."


def test_datagrams_are_copied_as_they_are(tmp_path: Path) -> None:
    session = motive_session()
    convert(session, tmp_path / "a.mcap")
    convert(tmp_path / "a.mcap", tmp_path / "b.pcapng")
    convert(tmp_path / "b.pcapng", tmp_path / "c.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "c.mcap").read_bytes()
    assert list(read_take(tmp_path / "c.mcap")) == list(read_take(session))


def test_attachment_is_copied_to_a_take_and_named_where_a_capture_has_no_room(tmp_path: Path) -> None:
    write_take(tmp_path / "a.mcap", made_up(20), TakeMetadata(), {"models.bin": b"names"})
    convert(tmp_path / "a.mcap", tmp_path / "b.mcap")
    assert read_take(tmp_path / "b.mcap").attachments == {"models.bin": b"names"}
    assert "models.bin" in convert(tmp_path / "a.mcap", tmp_path / "c.pcapng").notes[0]


def test_same_clip_always_gives_the_same_bytes(tmp_path: Path) -> None:
    convert(made_clip(tmp_path)[0], source := tmp_path / "talk.trc")
    for ending in TARGETS:
        convert(source, tmp_path / f"a{ending}")
        (tmp_path / "again").mkdir(exist_ok=True)
        convert(source, tmp_path / "again" / f"a{ending}")
        assert (tmp_path / f"a{ending}").read_bytes() == (tmp_path / "again" / f"a{ending}").read_bytes()


def test_recording_is_never_overwritten_and_a_table_is(tmp_path: Path) -> None:
    source, _ = made_clip(tmp_path)
    for name in ("old.mcap", "old.csv"):
        (tmp_path / name).write_bytes(b"old")
    with pytest.raises(OutputError, match="never overwritten"):
        convert(source, tmp_path / "old.mcap")
    convert(source, tmp_path / "old.csv")
    assert (tmp_path / "old.mcap").read_bytes() == b"old"
    assert read_clip(tmp_path / "old.csv").layout.names[0] == "m0"


def test_target_is_left_alone_when_a_conversion_fails(tmp_path: Path) -> None:
    source, _ = made_clip(tmp_path)
    with pytest.raises(InputError):
        convert(source.with_suffix(".trc"), tmp_path / "out.csv")
    with pytest.raises(OutputError, match="cannot be written"):
        convert(source, tmp_path / "nowhere" / "out.csv")
    too_many = MarkerClip(
        MarkerLayout("x", tuple(f"m{i}" for i in range(1200))), 60.0, np.ones((2, 1200, 3)), Path("x")
    )
    write_c3d(tmp_path / "many.c3d", too_many)
    with pytest.raises(InputError, match="too many"):
        convert(tmp_path / "many.c3d", tmp_path / "many.mcap")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["many.c3d", "talk.c3d"]


@pytest.mark.parametrize(("source", "target"), [("a.bvh", "b.csv"), ("talk.c3d", "b.xlsx"), ("talk.c3d", "b.pcap")])
def test_unknown_ending_is_said_with_those_that_are_known(tmp_path: Path, source: str, target: str) -> None:
    made_clip(tmp_path)
    with pytest.raises(InputError, match=r"ends in \.mcap, \.pcapng"):
        convert(tmp_path / source, tmp_path / target)
