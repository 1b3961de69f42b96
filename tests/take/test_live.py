"""A live stream over loopback, recorded: the take holds what the client saw, and a server can play it again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from retarget.frames import MarkerLayout
from retarget.markers.clip import MarkerClip
from retarget.take.decode import frames
from retarget.take.metadata import TakeMetadata
from retarget.take.reader import read_take
from retarget.take.recorder import TakeRecorder
from retarget.take.reel import TakeReel
from retarget.udp.natnet.reel import MarkerReel
from retarget.udp.natnet.server import NatNetServer, ServerSettings
from retarget.udp.natnet.source import NatNetSource

if TYPE_CHECKING:
    from retarget.frames import MarkerFrame
    from retarget.udp.natnet.reel import Reel

MARKERS, FRAMES = 24, 120


def clip() -> MarkerClip:
    rng = np.random.default_rng(3)
    positions = rng.uniform(-1, 1, (FRAMES, MARKERS, 3))
    positions[rng.random((FRAMES, MARKERS)) < 0.1] = np.nan
    return MarkerClip(MarkerLayout("face", tuple(f"m{i}" for i in range(MARKERS))), 240.0, positions, Path("face"))


def played(reel: Reel, path: Path) -> list[MarkerFrame]:
    """The frames that a client got of `reel`, which it recorded to `path` meanwhile."""
    with (
        NatNetServer(reel, ServerSettings(command_port=0)) as server,
        TakeRecorder(path, TakeMetadata()) as recorder,
        NatNetSource(f"natnet://127.0.0.1:{server.address[1]}", tap=recorder) as source,
    ):
        return list(source)


def same_markers(a: list[MarkerFrame], b: list[MarkerFrame]) -> bool:
    return [(f.number, f.positions.tobytes(), f.layout.names) for f in a] == [
        (f.number, f.positions.tobytes(), f.layout.names) for f in b
    ]


def test_recording_of_a_live_stream_gives_the_frames_that_were_seen_live(tmp_path: Path) -> None:
    live = played(MarkerReel(list(clip())), tmp_path / "live.mcap")
    take = read_take(tmp_path / "live.mcap")
    recorded = list(frames(take))
    assert len(live) == FRAMES
    assert same_markers(live, recorded)
    assert [f.received_s for f in live] == [f.received_s for f in recorded]
    assert {(d.channel, d.direction) for d in take} >= {("command", "in"), ("command", "out")}


def test_recorded_take_served_again_gives_the_same_frames(tmp_path: Path) -> None:
    first = played(MarkerReel(list(clip())), tmp_path / "first.mcap")
    again = played(TakeReel(read_take(tmp_path / "first.mcap")), tmp_path / "again.mcap")
    assert same_markers(first, again)
    assert same_markers(first, list(frames(read_take(tmp_path / "again.mcap"))))
