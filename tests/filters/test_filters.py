"""What every filter owes: constants pass, steps arrive, NaN and doubled packets change nothing, reset forgets.

The PD mass creeps its last half per cent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.filters import (
    BlinkTrick,
    ExponentialMean,
    Filter,
    Kalman,
    MovingMean,
    OneEuro,
    PdGains,
    PdMass,
    SteppedPdMass,
    VelocityKalman,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

IN_TIME: dict[str, Callable[[], Filter]] = {
    "one euro": OneEuro,
    "pd": lambda: PdMass(PdGains()),
    "pd with blinks": lambda: BlinkTrick(PdMass(PdGains()), threshold=-5.0),
    "exponential": lambda: ExponentialMean(0.05),
    "moving": lambda: MovingMean(0.05),
    "kalman": lambda: Kalman(0.5, 1e-3),
    "kalman from a start": lambda: Kalman(0.5, 1e-3, start=2.0),
    "velocity": lambda: VelocityKalman(30.0, 1e-4),
}
BY_SAMPLE: dict[str, Callable[[], Filter]] = {
    "stepped pd": lambda: SteppedPdMass(PdGains(), np.array([2.0, 2.0])),
}
ALL = IN_TIME | BY_SAMPLE


def run(smoother: Filter, values: Array, times: Array) -> Array:
    return np.array([smoother(v, t) for v, t in zip(values, times.tolist(), strict=True)])


@pytest.mark.parametrize("name", ALL)
def test_a_constant_passes_and_is_reached_after_a_step(name: str) -> None:
    times = np.arange(1200) / 60
    values = np.where(times < 10, 2.0, 3.0)[:, None] * np.array([1.0, 0.5])
    smooth = run(ALL[name](), values, times)
    np.testing.assert_allclose(smooth[599], [2.0, 1.0], atol=5e-3)
    np.testing.assert_allclose(smooth[-1], [3.0, 1.5], atol=5e-3)


@pytest.mark.parametrize("name", ALL)
def test_signals_do_not_touch_each_other(name: str) -> None:
    rng = np.random.default_rng(1)
    times, values = np.arange(60) / 60, rng.normal(size=(60, 2)) + 3
    other = values.copy()
    other[:, 1] = rng.normal(size=60)
    np.testing.assert_array_equal(run(ALL[name](), values, times)[:, 0], run(ALL[name](), other, times)[:, 0])


@pytest.mark.parametrize("name", ALL)
def test_reset_forgets_everything_and_input_and_output_stay_the_callers(name: str) -> None:
    rng = np.random.default_rng(2)
    times, values = np.arange(50) / 60, rng.normal(size=(50, 2))
    given = values.copy()
    smoother = ALL[name]()
    first = [smoother(v, t) for v, t in zip(values, times.tolist(), strict=True)]
    kept = np.array(first)
    smoother.reset()
    again = run(smoother, values, times)
    np.testing.assert_array_equal(again, kept)
    np.testing.assert_array_equal(np.array(first), kept)
    np.testing.assert_array_equal(values, given)


@pytest.mark.parametrize("name", ALL)
def test_what_is_missing_holds_and_comes_back(name: str) -> None:
    times, values = np.arange(600) / 60, np.full((600, 2), 2.0)
    values[100:200, 0] = np.nan
    smooth = run(ALL[name](), values, times)
    np.testing.assert_allclose(smooth[100:200, 0], smooth[99, 0], atol=5e-2)
    assert np.isfinite(smooth[100:]).all()
    np.testing.assert_allclose(smooth[-1], 2.0, atol=1e-3)


@pytest.mark.parametrize("name", IN_TIME)
def test_doubled_and_late_packets_change_nothing(name: str) -> None:
    rng = np.random.default_rng(3)
    times, values = np.arange(60) / 60, rng.normal(size=(60, 1))
    smoother, doubled = IN_TIME[name](), IN_TIME[name]()
    for v, t in zip(values, times.tolist(), strict=True):
        once, twice = smoother(v, t), doubled(v, t)
        np.testing.assert_array_equal(once, twice)
        np.testing.assert_array_equal(doubled(v + 1, t), once)
        np.testing.assert_array_equal(doubled(v - 1, t - 0.5), once)


@pytest.mark.parametrize("name", ["one euro", "pd", "exponential", "kalman", "velocity"])
def test_a_signal_that_is_first_seen_late_starts_where_it_is(name: str) -> None:
    smoother = IN_TIME[name]()
    assert np.isnan(smoother(np.array([np.nan, 1.0]), 0.0)[0])
    np.testing.assert_allclose(smoother(np.array([np.nan, 1.0]), 0.1)[1], 1.0)
    np.testing.assert_allclose(smoother(np.array([4.0, 1.0]), 0.2), [4.0, 1.0])


@pytest.mark.parametrize("name", ["one euro", "pd", "exponential", "velocity"])
@pytest.mark.parametrize("rate_hz", [24.0, 30.0, 120.0])
def test_the_answer_to_a_ramp_hardly_depends_on_the_rate(name: str, rate_hz: float) -> None:
    """A quarter of a second to go up by 1, and half a second to settle: as at 60 Hz, to a few hundredths."""

    def answer(rate: float) -> Array:
        times = np.arange(round(1.5 * rate) + 1) / rate
        smooth = run(IN_TIME[name](), np.clip((times - 0.5) / 0.25, 0, 1)[:, None], times)
        return np.interp([0.75, 0.8, 0.9, 1.2], times, smooth[:, 0])

    np.testing.assert_allclose(answer(rate_hz), answer(60.0), atol=0.09 if rate_hz < 60 else 0.05)


@pytest.mark.parametrize(
    "make",
    [
        lambda: OneEuro(min_cutoff_hz=0.0),
        lambda: OneEuro(beta=-1.0),
        lambda: ExponentialMean(0.0),
        lambda: ExponentialMean.of_gain(1.0, 60.0),
        lambda: MovingMean(0.0),
        lambda: Kalman(0.0, 1.0),
        lambda: VelocityKalman(1.0, float("nan")),
    ],
)
def test_parameters_that_make_no_filter_are_refused(make: Callable[[], Filter]) -> None:
    with pytest.raises(InputError):
        make()
