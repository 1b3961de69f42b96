"""A take as what a server plays."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.take.convert import write_take
from retarget.take.metadata import TakeMetadata
from retarget.take.reader import read_take
from retarget.take.reel import TakeReel
from retarget.udp.natnet.codec import encode
from retarget.udp.natnet.version import Bitstream
from tests.take.sessions import motive_session

if TYPE_CHECKING:
    from pathlib import Path

    from retarget.take.reader import Take


@pytest.fixture(params=["capture", "mcap"])
def take(request: pytest.FixtureRequest, tmp_path: Path) -> Take:
    session = read_take(motive_session())
    if request.param == "capture":
        return session
    write_take(tmp_path / "take.mcap", session, TakeMetadata())
    return read_take(tmp_path / "take.mcap")


def test_every_frame_is_the_recorded_one_to_the_last_byte(take: Take) -> None:
    reel = TakeReel(take)
    recorded = [d.payload for d in take if d.payload[:2] == b"\7\0"]
    assert len(reel.times_s) == len(recorded) == 518
    assert [encode(reel.frame(i), Bitstream(3, 0)) for i in range(518)] == recorded


def test_frames_can_be_had_in_any_order(take: Take) -> None:
    reel = TakeReel(take)
    rng = random.Random(5)
    for index in [517, 0, *(rng.randrange(518) for _ in range(60)), 517]:
        assert reel.frame(index).number == 162734 + index


def test_rate_times_and_names_are_those_of_the_take(take: Take) -> None:
    reel = TakeReel(take)
    assert reel.rate_hz == 120.0
    assert np.diff(reel.times_s).min() >= 0
    assert reel.times_s[-1] - reel.times_s[0] == pytest.approx(4.3, abs=0.1)
    assert "Marker1" in {name for s in reel.definitions.marker_sets for name in s.marker_names}


def test_frame_that_cannot_be_read_is_played_without_markers(take: Take, tmp_path: Path) -> None:
    from dataclasses import replace

    datagrams = list(take)
    broken = next(i for i, d in enumerate(datagrams) if d.payload[:2] == b"\7\0") + 3
    datagrams[broken] = replace(datagrams[broken], payload=datagrams[broken].payload[:60])
    write_take(tmp_path / "broken.mcap", datagrams, TakeMetadata())
    reel = TakeReel(read_take(tmp_path / "broken.mcap"))
    index = sum(d.payload[:2] == b"\7\0" for d in datagrams[:broken])
    assert len(reel.frame(index).labelled) == 0
    assert reel.frame(index).number == 162734 + index
    assert len(reel.frame(index + 1).labelled) == 6
