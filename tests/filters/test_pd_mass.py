"""The PD controlled mass against OpenVHead's recurrence, written out here one line at a time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget.errors import InputError
from retarget.filters import PdGains, PdMass, SteppedPdMass

MODEL_1_EYES = PdGains(mass=1, alpha=0.8)
MODEL_2_EYES = PdGains(mass=2, alpha=0.8)
MOUTH = PdGains(mass=1, alpha=0.7)


class OpenVHeadController:
    """One mass, as the description of ParameterServer.cs has it."""

    def __init__(self, start: float, M: float = 1.0, ALPHA: float = 0.7) -> None:
        self.T, self.KP, self.KD, self.M, self.ALPHA = 0.1, 0.04, 1.0, M, ALPHA
        self.X = start
        self.v = self.e_1 = self.d_1 = 0.0

    def update(self, x_d: float) -> float:
        x = self.X
        e = x_d - x
        de = (e - self.e_1) / self.T
        p = self.KP * e
        d = (1 - self.ALPHA) * self.KD * de + self.ALPHA * self.d_1
        F = p + d
        self.e_1, self.d_1 = e, d
        a = F / self.M
        self.v += a * self.T
        x += self.v * self.T
        if x < 0:
            x = 0.0
        self.X = x
        return x


@given(seed=st.integers(0, 10**6), M=st.sampled_from([1.0, 2.0, 5.0]), ALPHA=st.floats(0.0, 0.95))
def test_the_compatible_mass_is_the_recurrence_on_random_input(seed: int, M: float, ALPHA: float) -> None:
    targets = np.random.default_rng(seed).uniform(-0.2, 1.0, (200, 3))
    starts = np.array([0.2, 0.45, 0.03])
    ours = SteppedPdMass(PdGains(mass=M, alpha=ALPHA), starts)
    theirs = [OpenVHeadController(s, M, ALPHA) for s in starts]
    for i, target in enumerate(targets):
        expected = [c.update(x) for c, x in zip(theirs, target, strict=True)]
        np.testing.assert_allclose(ours(target, i / 60), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("gains", "to_63", "to_90"), [(MODEL_1_EYES, (11, 12), 18), (MODEL_2_EYES, (19, 20), (34, 36))]
)
def test_a_step_takes_the_number_of_updates_that_was_measured(
    gains: PdGains, to_63: tuple[int, int], to_90: int | tuple[int, int]
) -> None:
    ours = SteppedPdMass(gains, np.zeros(1))
    path = np.array([ours(np.ones(1), 0.0)[0] for _ in range(300)])
    assert 1 + int(np.argmax(path > 0.63)) in range(to_63[0], to_63[1] + 1)
    low, high = (to_90, to_90) if isinstance(to_90, int) else to_90
    assert low <= 1 + int(np.argmax(path > 0.9)) <= high
    assert 1.03 < path.max() < 1.08


def test_nothing_goes_below_zero() -> None:
    ours = SteppedPdMass(MOUTH, np.full(1, 0.5))
    assert min(ours(np.full(1, -1.0), 0.0)[0] for _ in range(50)) == 0.0


@given(seed=st.integers(0, 10**6), mass=st.floats(0.3, 5.0), alpha=st.sampled_from([0.0, 0.5, 0.7, 0.8, 0.95]))
def test_in_true_time_at_60_hz_it_is_the_compatible_mass(seed: int, mass: float, alpha: float) -> None:
    """As long as it stays off the floor, where the true one loses its speed and the compatible one does not."""
    gains = PdGains(mass=mass, alpha=alpha)
    targets = np.random.default_rng(seed).uniform(0.5, 1.5, (100, 2))
    true, stepped = PdMass(gains), SteppedPdMass(gains, targets[0], floor=-np.inf)
    for i, target in enumerate(targets):
        expected = stepped(target, 0.0) if i else target
        np.testing.assert_allclose(true(target, i / 60), expected, rtol=0, atol=1e-9)


@given(cuts=st.lists(st.floats(0.0, 0.5), min_size=1, max_size=8), alpha=st.sampled_from([0.0, 0.7, 0.8, 0.97]))
def test_in_true_time_steps_add_up(cuts: list[float], alpha: float) -> None:
    gains = PdGains(alpha=alpha)
    whole, parts = PdMass(gains), PdMass(gains)
    for smoother in (whole, parts):
        smoother(np.zeros(1), -0.02)
        smoother(np.full(1, 0.3), 0.0)
    end = [parts(np.ones(1), t)[0] for t in [*sorted(cuts), 0.5]][-1]
    assert end == pytest.approx(whole(np.ones(1), 0.5)[0], abs=1e-9)


def test_in_true_time_half_the_rate_gives_the_same_curve_where_the_compatible_mass_takes_twice_as_long() -> None:
    def ninety_percent_s(smoother: PdMass | SteppedPdMass, rate_hz: float) -> float:
        times = np.arange(round(4 * rate_hz)) / rate_hz
        path = [smoother(np.full(1, float(t > 0)), t)[0] for t in times.tolist()]
        return float(np.interp(0.9, np.maximum.accumulate(path), times))

    fast, slow = (ninety_percent_s(PdMass(MOUTH), rate) for rate in (120.0, 30.0))
    assert slow == pytest.approx(fast, rel=0.12)
    fast, slow = (ninety_percent_s(SteppedPdMass(MOUTH, np.zeros(1)), rate) for rate in (120.0, 30.0))
    assert slow == pytest.approx(4 * fast, rel=0.05)


def test_a_gap_of_minutes_lands_on_the_target() -> None:
    smoother = PdMass(MODEL_2_EYES)
    smoother(np.zeros(1), 0.0)
    assert smoother(np.ones(1), 300.0)[0] == pytest.approx(1.0)


def test_in_true_time_a_mass_that_hits_the_floor_stops_there_and_leaves_at_once() -> None:
    true, stepped = PdMass(MOUTH, floor=0.0), SteppedPdMass(MOUTH, np.full(1, 0.5))
    for i in range(60):
        low = true(np.full(1, -1.0 if i else 0.5), i / 60), stepped(np.full(1, -1.0 if i else 0.5), 0.0)
    assert low[0] == low[1] == 0.0
    for i in range(60, 64):
        high = true(np.ones(1), i / 60), stepped(np.ones(1), 0.0)
    assert high[0] > high[1]


def test_gains_that_are_not_overdamped_are_refused_with_the_least_kd() -> None:
    PdGains(kp=0.04, kd=1.0, mass=6.2)
    with pytest.raises(InputError, match=r"choose kd above 1, .*kd\^2 > 4 mass kp"):
        PdGains(kp=0.04, kd=1.0, mass=6.25)


@pytest.mark.parametrize("gains", [{"kp": 0.0}, {"mass": 0.0}, {"alpha": 1.0}, {"alpha": -0.1}, {"kd": -3.0}])
def test_gains_without_meaning_are_refused(gains: dict[str, float]) -> None:
    with pytest.raises(InputError):
        PdGains(**gains)


def test_gains_too_stiff_for_the_update_are_refused_in_true_time() -> None:
    with pytest.raises(InputError, match="too stiff"):
        PdMass(PdGains(kd=100.0, alpha=0.0))
