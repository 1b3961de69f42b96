"""The One-Euro filter beside the authors' own (PyPI OneEuroFilter), and what it is for."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget.filters import OneEuro

OneEuroFilter = pytest.importorskip("OneEuroFilter").OneEuroFilter


@given(
    seed=st.integers(0, 10**6),
    min_cutoff_hz=st.floats(0.05, 20.0),
    beta=st.floats(0.0, 30.0),
    speed_cutoff_hz=st.floats(0.1, 10.0),
)
def test_it_gives_the_numbers_of_its_authors_implementation_at_any_spacing(
    seed: int, min_cutoff_hz: float, beta: float, speed_cutoff_hz: float
) -> None:
    rng = np.random.default_rng(seed)
    times = 1.0 + np.cumsum(rng.uniform(0.002, 0.1, 40))  # theirs takes the time 0 for none
    values = np.cumsum(rng.normal(size=(40, 2)), axis=0)
    ours = OneEuro(min_cutoff_hz, beta, speed_cutoff_hz)
    theirs = [OneEuroFilter(60.0, min_cutoff_hz, beta, speed_cutoff_hz) for _ in range(2)]
    for v, t in zip(values, times.tolist(), strict=True):
        expected = [peer(float(x), t) for peer, x in zip(theirs, v, strict=True)]
        np.testing.assert_allclose(ours(v, t), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("rate_hz", [24.0, 60.0, 120.0])
def test_it_stills_a_face_at_rest_and_lets_a_blink_through(rate_hz: float) -> None:
    times = np.arange(round(4 * rate_hz)) / rate_hz
    blink = np.clip(1 - np.abs(times - 3) / 0.075, 0, 1)
    noisy = blink + np.random.default_rng(0).normal(scale=0.02, size=len(times))
    smoother = OneEuro()
    smooth = np.array([smoother(np.array([v]), t)[0] for v, t in zip(noisy, times.tolist(), strict=True)])
    still = (times > 0.5) & (times < 2.5)
    assert np.diff(smooth[still], 2).std() < 0.35 * np.diff(noisy[still], 2).std()
    assert smooth.max() > 0.75 * noisy.max()
