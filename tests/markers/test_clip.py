"""A take in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from retarget.markers import MarkerClip
from tests.markers.takes import layout

CLIP = MarkerClip(layout("a", "b"), 50.0, np.arange(18.0).reshape(3, 2, 3), Path("take.c3d"), first_frame=101)


def test_frames_are_numbered_from_0_in_the_files_own_time() -> None:
    frames = list(CLIP)
    assert [f.number for f in frames] == [0, 1, 2]
    assert [f.time_s for f in frames] == [f.received_s for f in frames] == [0.0, 0.02, 0.04]
    np.testing.assert_array_equal([f.positions for f in frames], CLIP.positions)
    assert all(f.layout is CLIP.layout and f.T_world_head is None for f in frames)


def test_the_duration_counts_a_period_for_every_frame() -> None:
    assert len(CLIP) == 3
    assert CLIP.duration_s == 0.06


@pytest.mark.parametrize("number", [-1, 3])
def test_a_frame_beyond_the_take_is_an_index_error(number: int) -> None:
    with pytest.raises(IndexError, match="of a take of 3 frames"):
        CLIP.frame(number)
