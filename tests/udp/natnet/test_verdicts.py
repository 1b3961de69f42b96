"""What the counts of a stream mean, where no server on loopback can show it."""

from __future__ import annotations

import math

import pytest

from retarget.udp.natnet.clock import EchoClock
from retarget.udp.natnet.diagnosis import Outcome
from retarget.udp.natnet.observation import Observation
from retarget.udp.natnet.verdicts import (
    TOLERATED_LOSS,
    judge_clock,
    judge_losses,
    judge_markers,
    judge_names,
    judge_version,
    shortened,
)
from retarget.udp.natnet.version import LATEST, OLDEST, Bitstream
from retarget.udp.stats import StreamStats


def read_clock(round_trip_s: float) -> EchoClock:
    clock = EchoClock(1000)
    clock.add(10.0, 10.0 + round_trip_s, 5000)
    return clock


@pytest.mark.parametrize("version", [OLDEST, Bitstream(3, 0), LATEST])
def test_every_known_version_passes(version: Bitstream) -> None:
    step = judge_version(version, version, Observation())
    assert step.outcome is Outcome.PASSED
    assert str(version) in step.found


def test_a_version_that_was_agreed_is_told_beside_the_announced_one() -> None:
    found = judge_version(Bitstream(4, 2), Bitstream(4, 1), Observation()).found
    assert "4.2" in found
    assert "4.1" in found


def test_the_version_before_the_oldest_fails() -> None:
    assert judge_version(Bitstream(2, 4), None, Observation()).outcome is Outcome.FAILED


def test_definitions_that_cannot_be_read_are_told_from_missing_ones() -> None:
    observed = Observation()
    missing = judge_names((), observed)
    observed.unreadable_definitions = 1
    step = judge_names((), observed)
    assert step.outcome is Outcome.FAILED
    assert "cannot be read" in step.found
    assert missing.outcome is Outcome.FAILED
    assert "came, though" in missing.found


def test_frames_without_anything_in_them_point_to_the_streaming_settings() -> None:
    observed = Observation()
    observed.described, observed.frames = True, 10
    step = judge_markers(("chin", "nose"), observed)
    assert step.outcome is Outcome.FAILED
    assert "Labeled Markers" in step.advice


def test_a_clock_that_was_never_announced_is_skipped() -> None:
    assert judge_clock(None, ()).outcome is Outcome.SKIPPED


@pytest.mark.parametrize("latency_s", [-3600.0, -0.5, 2.0, 86_400.0])
def test_stamps_of_another_clock_are_not_in_sync(latency_s: float) -> None:
    step = judge_clock(read_clock(0.001), [latency_s] * 5)
    assert step.outcome is Outcome.WARNED
    assert "not in sync" in step.cause


@pytest.mark.parametrize("latency_s", [0.0, 0.004, 0.3])
def test_stamps_shortly_before_arrival_are_in_sync(latency_s: float) -> None:
    assert judge_clock(read_clock(0.001), [latency_s] * 5).outcome is Outcome.PASSED


def test_one_wild_stamp_does_not_make_a_clock_wrong() -> None:
    assert judge_clock(read_clock(0.001), [0.004] * 5 + [1e9]).outcome is Outcome.PASSED


def test_a_slow_round_trip_is_a_warning_with_its_duration() -> None:
    step = judge_clock(read_clock(0.05), [0.004])
    assert step.outcome is Outcome.WARNED
    assert "50.00 ms" in step.found


@pytest.mark.parametrize(
    ("stats", "outcome", "cause"),
    [
        (StreamStats(received=1000), Outcome.PASSED, ""),
        (StreamStats(received=1000, foreign=50, late=0), Outcome.PASSED, ""),
        (StreamStats(received=999, lost=1), Outcome.WARNED, "on the way"),
        (StreamStats(received=900, lost=100), Outcome.FAILED, "on the way"),
        (StreamStats(received=900, lost=100, overflowed=100), Outcome.FAILED, "this machine"),
        (StreamStats(received=900, dropped=100), Outcome.FAILED, "this machine"),
        (StreamStats(received=1000, doubled=1000), Outcome.WARNED, "two ways"),
        (StreamStats(received=1000, malformed=3), Outcome.WARNED, "something else"),
    ],
)
def test_losses_are_weighed_and_traced_to_where_they_happen(stats: StreamStats, outcome: Outcome, cause: str) -> None:
    step = judge_losses(stats)
    assert step.outcome is outcome
    assert cause in step.cause
    assert bool(step.cause) == bool(step.advice) == (outcome is not Outcome.PASSED)


def test_a_hundredth_lost_is_tolerated_and_more_is_not() -> None:
    lost = math.floor(1000 * TOLERATED_LOSS)
    assert judge_losses(StreamStats(received=1000 - lost, lost=lost)).outcome is Outcome.WARNED
    assert judge_losses(StreamStats(received=999 - lost, lost=lost + 1)).outcome is Outcome.FAILED


def test_many_names_are_shortened_and_counted() -> None:
    assert shortened(("a", "b")) == "a, b"
    assert shortened(tuple("abcdefgh")) == "a, b, c, d, e, f and 2 more"
