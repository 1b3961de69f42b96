"""One minute of `tests.soak`."""

from __future__ import annotations

from tests.soak import RATE_HZ, soak


def test_four_streams_at_240_hz_are_recorded_without_loss_in_flat_memory() -> None:
    for recorded in soak(60.0):
        print(recorded)
        assert (recorded.lost, recorded.malformed) == (0, 0)
        assert recorded.frames > 50 * RATE_HZ
        assert recorded.grown_mb < 5
