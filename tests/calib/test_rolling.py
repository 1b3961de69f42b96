"""Filters over time, against naive loops."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from calib.rolling import rolling_mean, rolling_median, without_spikes


def with_gaps(seed: int, shape: tuple[int, ...]) -> np.ndarray:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=shape)
    values[rng.random(shape) < 0.4] = np.nan
    return values


@pytest.mark.parametrize("half", [0, 1, 4, 30])
def test_median_and_mean_are_those_of_what_is_seen_in_the_window(half: int) -> None:
    values = with_gaps(half, (40, 3))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        windows = [values[max(t - half, 0) : t + half + 1] for t in range(len(values))]
        medians = np.array([np.nanmedian(w, axis=0) for w in windows])
        means = np.array([np.nanmean(w, axis=0) for w in windows])
    np.testing.assert_allclose(rolling_median(values, half), medians)
    np.testing.assert_allclose(rolling_mean(values, half), means, atol=1e-12)


def test_spikes_go_and_fast_motion_stays() -> None:
    t = np.arange(200) / 120
    path = np.stack([0.02 * np.sin(2 * np.pi * 3 * t), 0 * t, 0 * t], axis=1)[:, None]
    spiked = path.copy()
    spiked[[20, 77, 140], 0] += [0.0, 0.006, 0.0]
    clean = without_spikes(spiked)
    assert np.flatnonzero(np.isnan(clean[:, 0, 0])).tolist() == [20, 77, 140]


def test_a_gap_stays_a_gap_and_takes_no_neighbour_with_it() -> None:
    positions = np.zeros((30, 2, 3))
    positions[10:13, 0] = np.nan
    np.testing.assert_array_equal(without_spikes(positions), positions)
