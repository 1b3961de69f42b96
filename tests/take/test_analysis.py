"""What inspection tells, of takes and clips whose losses and gaps are known."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget.errors import InputError
from retarget.frames import MarkerLayout
from retarget.markers.clip import MarkerClip
from retarget.take.analysis import inspect_clip, inspect_take
from retarget.take.convert import write_take
from retarget.take.encode import datagrams_of, metadata_of
from retarget.take.plots import MOST_MARKERS, plot_inspection
from retarget.take.reader import read_take
from retarget.take.visibility import runs
from tests.take.sessions import motive_session

if TYPE_CHECKING:
    from retarget.take.analysis import Inspection
    from retarget.udp.datagram import Datagram


def clip_with_gaps() -> MarkerClip:
    """Three markers at 100 Hz for 2 s: whole, with gaps of 10 and 30 frames, and never seen."""
    positions = np.tile([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [np.nan] * 3], (200, 1, 1))
    positions[:, 0, 0] += np.linspace(0, 0.03, 200)
    positions[50, 0, 1] += 0.004
    positions[20:30, 1] = np.nan
    positions[170:, 1] = np.nan
    return MarkerClip(MarkerLayout("made", ("chin", "brow", "ghost")), 100.0, positions, Path("made.c3d"))


def recorded(tmp_path: Path, datagrams: list[Datagram]) -> Inspection:
    write_take(tmp_path / "take.mcap", datagrams, metadata_of(clip_with_gaps()))
    return inspect_take(read_take(tmp_path / "take.mcap"))


def test_gaps_steps_and_extents_of_each_marker_are_told() -> None:
    chin, brow, ghost = inspect_clip(clip_with_gaps()).markers
    assert (chin.seen, chin.gaps, chin.longest_gap_s) == (1.0, 0, 0.0)
    assert chin.largest_step_mm == pytest.approx(np.hypot(4.0, 30 / 199), abs=1e-9)
    assert chin.extent_mm == pytest.approx(np.hypot(30.0, 4.0))
    assert (brow.seen, brow.gaps, brow.largest_step_mm, brow.extent_mm) == (0.8, 2, 0.0, 0.0)
    assert brow.longest_gap_s == pytest.approx(0.3)
    assert (ghost.seen, ghost.gaps, ghost.largest_step_mm, ghost.extent_mm) == (0.0, 1, 0.0, 0.0)
    assert ghost.longest_gap_s == pytest.approx(2.0)


def test_take_tells_the_same_of_the_markers_as_the_clip_that_it_was_made_of(tmp_path: Path) -> None:
    inspection = recorded(tmp_path, list(datagrams_of(clip_with_gaps())))
    for told, truth in zip(inspection.markers, inspect_clip(clip_with_gaps()).markers, strict=True):
        assert (told.name, told.seen, told.gaps) == (truth.name, truth.seen, truth.gaps)
        assert told.longest_gap_s == pytest.approx(truth.longest_gap_s)
        assert told.extent_mm == pytest.approx(truth.extent_mm, abs=1e-3)
    assert inspection.rate_hz == 100.0
    assert inspection.facts["bitstream"] == "4.1"


def test_lost_doubled_and_malformed_datagrams_are_counted(tmp_path: Path) -> None:
    datagrams = list(datagrams_of(clip_with_gaps()))
    frames = [i for i, d in enumerate(datagrams) if d.channel == "data"]
    datagrams[frames[60]] = replace(datagrams[frames[60]], payload=datagrams[frames[60]].payload[:50])
    datagrams.insert(frames[100], datagrams[frames[99]])
    del datagrams[frames[120] : frames[127]]
    inspection = recorded(tmp_path, datagrams)
    frames_told = inspection.frames
    assert (frames_told.lost, frames_told.doubled, frames_told.malformed) == (8, 1, 1)
    assert frames_told.received == 192
    assert (frames_told.first_number, frames_told.last_number) == (1, 200)
    [data] = [channel for channel in inspection.channels if channel.channel == "data"]
    assert data.datagrams == 194
    assert data.interval is not None
    assert data.interval.max_ms == pytest.approx(80.0)
    assert data.interval.p50_ms == pytest.approx(10.0)


def test_real_session_is_told_as_wireshark_counts_it() -> None:
    inspection = inspect_take(read_take(motive_session()))
    counts = {(c.channel, c.direction): (c.datagrams, c.octets) for c in inspection.channels}
    assert counts[("data", "in")] == (518, 518 * 336)
    assert sum(datagrams for datagrams, _ in counts.values()) == 550
    [data] = [c for c in inspection.channels if c.channel == "data"]
    assert data.interval is not None
    assert data.interval.max_ms == pytest.approx(12.789, abs=1e-3)
    assert inspection.facts["server"] == "Motive"
    assert (inspection.facts["server version"], inspection.facts["bitstream"]) == ("2.1.0.0", "3.0")
    assert [marker.seen for marker in inspection.markers] == [1.0] * 5


def test_dictionary_goes_through_json_unchanged() -> None:
    for inspection in (inspect_clip(clip_with_gaps()), inspect_take(read_take(motive_session()))):
        told = inspection.as_dict()
        assert json.loads(json.dumps(told, allow_nan=False))["markers"] == told["markers"]
        assert "seen" not in told


@given(st.lists(st.booleans(), max_size=40))
def test_runs_cover_exactly_the_true_values(flags: list[bool]) -> None:
    found = runs(np.array(flags, bool))
    covered = [any(start <= i < end for start, end in found) for i in range(len(flags))]
    assert covered == flags
    assert all(a[1] < b[0] for a, b in pairwise(found))


@pytest.mark.parametrize("ending", [".png", ".svg"])
def test_plot_is_written_for_a_take_and_for_a_clip(tmp_path: Path, ending: str) -> None:
    take = recorded(tmp_path, list(datagrams_of(clip_with_gaps())))
    for name, inspection in (("take", take), ("clip", inspect_clip(clip_with_gaps()))):
        path = tmp_path / f"{name}{ending}"
        plot_inspection(inspection, path)
        assert path.read_bytes()[:5] in (b"\x89PNG\r", b"<?xml")


def test_gaps_are_red_in_the_plot_where_they_are(tmp_path: Path) -> None:
    from PIL import Image

    path = tmp_path / "clip.png"
    plot_inspection(inspect_clip(clip_with_gaps()), path)
    picture = np.asarray(Image.open(path).convert("RGB")).astype(int)
    red = (picture[..., 0] > 150) & (picture[..., 1] < 90)
    lengths = red.sum(axis=1)
    shares = Counter((lengths / lengths.max()).round(2).tolist())
    del shares[0.0]
    brow, ghost = sorted(share for share, _ in shares.most_common(2))  # but for the edges of the bars
    assert (brow, ghost) == (pytest.approx(0.2, abs=0.011), 1.0)


def test_plot_of_very_many_markers_keeps_to_those_that_were_seen_least(tmp_path: Path) -> None:
    count = MOST_MARKERS + 200
    positions = np.ones((10, count, 3))
    layout = MarkerLayout("many", tuple(f"m{i}" for i in range(count)))
    plot_inspection(inspect_clip(MarkerClip(layout, 60.0, positions, Path("many.c3d"))), tmp_path / "many.svg")
    assert (tmp_path / "many.svg").stat().st_size > 10_000


def test_unknown_picture_format_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"ends in \.png, \.svg, \.pdf"):
        plot_inspection(inspect_clip(clip_with_gaps()), tmp_path / "plot.txt")
