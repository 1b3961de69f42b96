"""Percentiles out of logarithmic bins, beside numpy's exact ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

from retarget.latency import LatencyHistogram


def test_percentiles_agree_with_numpy_to_two_percent() -> None:
    durations = np.random.default_rng(3).lognormal(mean=-6, sigma=1.5, size=20_000)
    histogram = LatencyHistogram()
    for d in durations:
        histogram.add(d)
    for percent in (1, 50, 99):
        assert histogram.percentile_ms(percent) == pytest.approx(1e3 * np.percentile(durations, percent), rel=0.03)


def test_a_histogram_without_frames_knows_no_percentile() -> None:
    assert math.isnan(LatencyHistogram().percentile_ms(50))


@pytest.mark.parametrize("duration", [-1.0, 0.0, 1e9])
def test_durations_out_of_range_are_counted_at_the_ends(duration: float) -> None:
    histogram = LatencyHistogram()
    histogram.add(duration)
    assert math.isfinite(histogram.percentile_ms(50))
