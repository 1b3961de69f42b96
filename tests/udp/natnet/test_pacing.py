"""When frames are due, and which comes next."""

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.udp.natnet.pacing import FastestPace, OriginalPace, Schedule, SteadyPace
from retarget.udp.natnet.playback import AtEnd, Playback

TIMES_S = np.array([0.0, 0.0038, 0.0166, 0.025, 99.0])


def test_the_original_pace_keeps_the_jitter_and_shortens_endless_gaps() -> None:
    pace = OriginalPace()
    assert pace.interval_s(TIMES_S, 120.0, 0, 1) == pytest.approx(0.0038)
    assert pace.interval_s(TIMES_S, 120.0, 1, 2) == pytest.approx(0.0128)
    assert pace.interval_s(TIMES_S, 120.0, 3, 4) == 10.0
    assert pace.interval_s(TIMES_S, 120.0, 4, 0) == pytest.approx(1 / 120)


def test_a_steady_pace_ignores_the_take_and_the_fastest_never_waits() -> None:
    assert SteadyPace(240.0).interval_s(TIMES_S, 120.0, 1, 2) == pytest.approx(1 / 240)
    assert FastestPace().interval_s(TIMES_S, 120.0, 1, 2) == 0.0
    with pytest.raises(InputError, match="cannot be served"):
        SteadyPace(0.0)


def test_late_frames_do_not_delay_those_that_follow() -> None:
    schedule = Schedule(10.0)
    for i in range(1000):
        sent_s = schedule.due_s + (0.004 if i % 7 == 0 else 0.0001)
        schedule.advance(0.01, sent_s)
    assert schedule.due_s == pytest.approx(20.0)


def test_far_behind_the_schedule_starts_anew_instead_of_catching_up_in_a_burst() -> None:
    schedule = Schedule(10.0)
    schedule.advance(0.01, 15.0)
    assert schedule.due_s == 15.0


def _played(playback: Playback, most: int = 50) -> list[int]:
    indices: list[int] = []
    while not playback.finished and len(indices) < most:
        indices.append(playback.index)
        playback.advance()
    return indices


def test_a_reel_is_played_once_or_over_and_over() -> None:
    assert _played(Playback(4)) == [0, 1, 2, 3]
    assert _played(Playback(3, at_end=AtEnd.LOOP), most=8) == [0, 1, 2, 0, 1, 2, 0, 1]


def test_a_range_bounds_what_is_played_and_where_one_can_jump() -> None:
    playback = Playback(10)
    playback.begin_at(3)
    playback.end_at(5)
    assert _played(playback) == [3, 4, 5]
    playback.play()
    assert playback.index == 3
    playback.jump(99)
    assert playback.index == 5
    playback.jump(-1)
    assert playback.index == 3


def test_a_range_outside_of_the_reel_is_cut_to_it() -> None:
    playback = Playback(10)
    playback.end_at(1_000_000)
    playback.begin_at(-5)
    assert _played(playback) == list(range(10))


@pytest.mark.parametrize("speed", [0.0, -1.0, 1e6, float("nan")])
def test_a_speed_that_cannot_be_played_is_refused(speed: float) -> None:
    with pytest.raises(InputError, match="speed"):
        Playback(10, speed)
