"""Film rates: every pose of a slow stream, an even share of a fast one, repeats over gaps."""

from __future__ import annotations

import numpy as np
import pytest

from retarget.sampling import PictureClock, picture_rate_hz


@pytest.mark.parametrize(
    ("stream", "picture"), [(24.0, 24.0), (60.0, 60.0), (59.94, 59.94), (100.0, 50.0), (120.0, 60.0), (240.0, 60.0)]
)
def test_the_picture_rate_is_the_largest_whole_fraction_up_to_sixty(stream: float, picture: float) -> None:
    assert picture_rate_hz(stream) == pytest.approx(picture)


@pytest.mark.parametrize("unknown", [None, 0.0, float("nan"), -1.0])
def test_a_stream_of_unknown_rate_is_filmed_at_sixty(unknown: float | None) -> None:
    assert picture_rate_hz(unknown) == 60.0


def test_a_sixty_hertz_take_gives_one_picture_a_frame_in_spite_of_jitter() -> None:
    rng = np.random.default_rng(1)
    clock = PictureClock(60.0)
    times = 17.3 + np.arange(1590) / 60 + rng.uniform(-0.003, 0.003, 1590)
    times[0] = 17.3
    assert [clock.due(t) for t in times] == [1] * 1590


def test_a_stream_at_twice_the_rate_gives_every_second_pose() -> None:
    clock = PictureClock(60.0)
    assert [clock.due(i / 120) for i in range(8)] == [1, 0] * 4


@pytest.mark.parametrize(("stream_hz", "picture_hz"), [(240, 60), (120, 12), (120, 24), (60, 30)])
def test_each_picture_shows_the_pose_of_its_own_time(stream_hz: int, picture_hz: int) -> None:
    clock = PictureClock(picture_hz)
    drawn = [i for i in range(stream_hz * 20) if clock.due(i / stream_hz)]
    assert drawn == list(range(0, stream_hz * 20, stream_hz // picture_hz))


def test_a_gap_is_filled_so_that_the_film_keeps_its_time() -> None:
    clock = PictureClock(60.0)
    assert [clock.due(t / 60) for t in (0, 1, 5, 6)] == [1, 1, 4, 1]


def test_an_hour_of_rest_costs_two_seconds_of_film() -> None:
    clock = PictureClock(60.0)
    clock.due(0.0)
    assert clock.due(3600.0) == 120
    assert clock.due(3600.0 + 1 / 60) == 1


def test_a_clock_that_is_set_back_starts_anew() -> None:
    clock = PictureClock(60.0)
    clock.due(100.0)
    assert [clock.due(5.0), clock.due(5.0 + 1 / 60)] == [1, 1]
