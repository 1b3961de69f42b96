"""Means over the past."""

from __future__ import annotations

import numpy as np
import pytest

from retarget.filters import ExponentialMean, MovingMean


def test_the_mean_of_a_span_of_time_takes_in_what_lies_in_it() -> None:
    mean = MovingMean(0.1)
    samples = [(0.0, 10.0, 10.0), (0.05, 20.0, 15.0), (0.1, 30.0, 20.0), (0.13, 40.0, 30.0), (1.0, 7.0, 7.0)]
    for t, v, expected in samples:
        assert mean(np.array([v]), t)[0] == pytest.approx(expected)


def test_the_exponential_mean_has_its_gain_at_its_rate_and_its_time_constant_at_all() -> None:
    mean = ExponentialMean.of_gain(0.27, 60.0)
    mean(np.zeros(1), 0.0)
    assert mean(np.ones(1), 1 / 60)[0] == pytest.approx(0.27)
    assert mean(np.ones(1), 3 / 60)[0] == pytest.approx(1 - 0.73**3)
    slow = ExponentialMean(0.2)
    slow(np.zeros(1), 5.0)
    assert slow(np.ones(1), 5.2)[0] == pytest.approx(1 - np.exp(-1))
