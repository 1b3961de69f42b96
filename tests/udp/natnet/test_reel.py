"""What a server plays of marker frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.udp.natnet.codec import decode, encode
from retarget.udp.natnet.framedata import FrameOfData
from retarget.udp.natnet.names import MarkerNames
from retarget.udp.natnet.reel import MarkerReel
from retarget.udp.natnet.version import Bitstream
from tests.udp.natnet.wire import NAMES, marker_frames

VERSIONS = [Bitstream(2, 5), Bitstream(2, 9), Bitstream(3, 0), Bitstream(3, 1), Bitstream(4, 0), Bitstream(4, 1)]


def _again(reel: MarkerReel, index: int, version: Bitstream) -> FrameOfData:
    frame = decode(encode(reel.frame(index), version), version)
    assert isinstance(frame, FrameOfData)
    return frame


@pytest.mark.parametrize("version", VERSIONS, ids=str)
def test_markers_unseen_markers_and_loose_points_survive_every_bitstream(version: Bitstream) -> None:
    first = marker_frames(1)[0]
    positions = first.positions.copy() + 0.5
    positions[1] = np.nan
    loose = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
    reel = MarkerReel([replace(first, positions=positions, unlabelled=loose)])
    names = MarkerNames()
    names.describe(reel.definitions)
    named = names.name(_again(reel, 0, version))
    assert named.layout.names == NAMES
    assert named.positions == pytest.approx(positions, abs=1e-7, nan_ok=True)
    assert np.sort(named.unlabelled, axis=0) == pytest.approx(loose, abs=1e-7)


def test_the_rate_follows_from_the_times_unless_given() -> None:
    frames = marker_frames(20, rate_hz=60.0)
    assert MarkerReel(frames).rate_hz == pytest.approx(60.0)
    assert MarkerReel(frames, rate_hz=59.94).rate_hz == 59.94
    assert MarkerReel(frames[:1]).rate_hz == 1.0


def test_times_that_go_back_are_held() -> None:
    frames = marker_frames(3)
    frames[1] = replace(frames[1], time_s=-5.0)
    assert np.all(np.diff(MarkerReel(frames).times_s) >= 0)


def test_what_cannot_be_served_is_said() -> None:
    with pytest.raises(InputError, match="no frames"):
        MarkerReel([])
    with pytest.raises(InputError, match="same markers"):
        MarkerReel([*marker_frames(1), *marker_frames(1, ("other",))])
    with pytest.raises(InputError, match="too many"):
        MarkerReel(marker_frames(1, tuple(map(str, range(1001)))))


def test_a_thousand_markers_still_fit_into_a_datagram() -> None:
    reel = MarkerReel(marker_frames(1, tuple(map(str, range(1000)))))
    assert len(encode(reel.frame(0), Bitstream(4, 1))) < 65_507
