"""The sender's clocks, against clocks and networks whose truth is known."""

import math

import numpy as np
import pytest

from retarget.udp.natnet.clock import DelayClock, EchoClock

TICKS_PER_S = 3_312_787  # of the recorded server


class Server:
    """A clock that is off by `offset_s` and runs slower by `drift`; a network whose two ways differ."""

    def __init__(self, offset_s: float, drift: float, seed: int = 1) -> None:
        self.offset_s, self.drift = offset_s, drift
        self._rng = np.random.default_rng(seed)

    def ticks(self, local_s: float) -> int:
        return round((local_s - self.offset_s) * (1.0 - self.drift) * TICKS_PER_S)

    def delay_s(self) -> float:
        return float(1e-4 + self._rng.exponential(3e-4))


def _synchronised(server: Server, start_s: float, echoes: int, step_s: float) -> EchoClock:
    clock = EchoClock(TICKS_PER_S)
    for i in range(echoes):
        sent_s = start_s + i * step_s
        answered_s = sent_s + server.delay_s()
        clock.add(sent_s, answered_s + server.delay_s(), server.ticks(answered_s))
    return clock


def test_echoes_give_the_local_time_of_the_servers_ticks_within_half_the_best_round_trip() -> None:
    server = Server(offset_s=-417_000.25, drift=0.0)
    clock = _synchronised(server, 1000.0, echoes=10, step_s=0.03)
    error_s = abs(clock.local_s(server.ticks(1001.0)) - 1001.0)
    assert error_s <= 0.5 * clock.best_round_trip_s + 1e-6
    assert clock.best_round_trip_s < 1e-3


@pytest.mark.parametrize("drift", [-8e-5, 5e-6, 8e-5])
def test_a_drift_is_learnt_and_followed_between_echoes(drift: float) -> None:
    server = Server(offset_s=12.5, drift=drift)
    clock = _synchronised(server, 1000.0, echoes=120, step_s=1.0)
    assert clock.drift == pytest.approx(drift, abs=4e-6)
    later_s = 1000.0 + 125.0
    assert clock.local_s(server.ticks(later_s)) == pytest.approx(later_s, abs=5e-4)


def test_without_an_echo_no_time_is_invented() -> None:
    clock = EchoClock(TICKS_PER_S)
    assert not clock.synchronised
    assert math.isnan(clock.local_s(1234))
    assert math.isnan(clock.best_round_trip_s)


def test_a_restarted_server_is_learnt_anew() -> None:
    clock = _synchronised(Server(0.0, 0.0), 1000.0, echoes=60, step_s=1.0)
    restarted = Server(offset_s=1060.0, drift=0.0)
    clock.add(1061.0, 1061.0002, restarted.ticks(1061.0001))
    assert clock.local_s(restarted.ticks(1062.0)) == pytest.approx(1062.0, abs=2e-4)


def test_an_answer_from_before_the_question_is_ignored() -> None:
    clock = EchoClock(TICKS_PER_S)
    clock.add(10.0, 9.0, 5)
    assert not clock.synchronised


def test_one_slow_echo_among_quick_ones_changes_nothing() -> None:
    clock = EchoClock(1000)
    for sent_s in (0.0, 1.0, 2.0):
        clock.add(sent_s, sent_s + 0.002, round((sent_s + 0.001) * 1000))
    before_s = clock.local_s(5000)
    clock.add(3.0, 3.2, 3190)
    assert clock.local_s(5000) == before_s


def test_the_smallest_delay_stands_for_all() -> None:
    clock = DelayClock()
    rng = np.random.default_rng(2)
    delays_s = 0.001 + rng.exponential(0.004, 500)
    delays_s[3] = 0.001
    times_s = [clock.local_s(i / 100, 50.0 + i / 100 + delay) for i, delay in enumerate(delays_s)]
    assert times_s[10:] == pytest.approx([50.001 + i / 100 for i in range(10, 500)], abs=1e-9)


def test_a_slowly_drifting_sender_is_followed_within_a_millisecond() -> None:
    clock = DelayClock()
    errors_s = []
    for i in range(30_000):
        local_s = 100.0 + i / 100
        mapped_s = clock.local_s(local_s * (1.0 - 2e-5), local_s + 0.0005)
        errors_s.append(abs(mapped_s - local_s))
    assert max(errors_s) < 0.002


def test_time_stamps_that_go_back_start_over() -> None:
    clock = DelayClock()
    clock.local_s(500.0, 10.0)
    assert clock.local_s(2.0, 11.0) == 11.0


def test_a_sender_that_was_paused_is_not_thought_late_for_ever() -> None:
    clock = DelayClock()
    for i in range(100):
        clock.local_s(i / 100, i / 100 + 0.001)
    assert clock.local_s(1.01, 61.0) == 61.0
