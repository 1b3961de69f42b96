"""The error-bounded fit: it keeps its promise, and needs fewer keys than lines do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from retarget.export.keys import angle_deg, euclidean, fit_curves, fit_tracks, line_keys, report_keys
from retarget.export.keys.fitting import STRETCH
from retarget.export.keys.tracks import without_flips

JAW = Path(__file__).parents[3] / "../shared/data/animface/jaw.c3d"
ROUNDING = 1e-9


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 300), tolerance=st.floats(0.001, 2.0))
def test_every_recorded_time_is_within_the_tolerance(seed: int, count: int, tolerance: float) -> None:
    rng = np.random.default_rng(seed)
    times_s = np.cumsum(rng.uniform(0.001, 0.1, count))
    values = np.cumsum(rng.normal(size=(3, count, 2)) * 0.3, axis=1)
    for curve, recorded in zip(fit_curves(times_s, values, tolerance), values, strict=True):
        assert euclidean(curve(times_s), recorded).max() <= tolerance + ROUNDING
        assert {*curve.times_s} <= {*times_s}
        assert curve.times_s[[0, -1]].tolist() == times_s[[0, -1]].tolist()


def test_a_cubic_needs_two_keys_however_long_it_is() -> None:
    times_s = np.linspace(0, 1, 2 * STRETCH + 77)
    values = (2 - times_s + 3 * times_s**2 - 4 * times_s**3)[None, :, None]
    (curve,) = fit_curves(times_s, values, 1e-4)
    assert len(curve.times_s) == 2
    assert curve.out_slopes[0, 0] == pytest.approx(-1, abs=1e-2)
    assert curve.in_slopes[-1, 0] == pytest.approx(-1 + 6 - 12, abs=1e-2)


def test_a_curve_is_what_scipy_evaluates() -> None:
    times_s = np.linspace(0, 3, 200)
    (curve,) = fit_curves(times_s, np.sin(5 * times_s)[None, :, None], 0.01)
    between = np.linspace(0, 3, 999)
    for start in range(len(curve.times_s) - 1):
        pair = slice(start, start + 2)
        slopes = np.stack([curve.out_slopes[start], curve.in_slopes[start + 1]])
        own = between[(between >= curve.times_s[start]) & (between < curve.times_s[start + 1])]
        theirs = CubicHermiteSpline(curve.times_s[pair], curve.values[pair], slopes)(own)
        np.testing.assert_allclose(curve(own), theirs, atol=1e-12)


def test_each_channel_has_its_own_tolerance() -> None:
    times_s = np.linspace(0, 4, 400)
    wave = np.tile(np.sin(9 * times_s), (2, 1))[..., None]
    fine, coarse = fit_curves(times_s, wave, [0.001, 0.2])
    assert len(coarse.times_s) < len(fine.times_s)
    assert np.abs(coarse(times_s) - wave[1]).max() > 0.001


def test_a_turn_past_half_a_turn_does_not_flip() -> None:
    times_s = np.linspace(0, 2, 240)
    quats = Rotation.from_rotvec(np.outer(3 * times_s, [0.0, 0.6, 0.8])).as_quat(canonical=True)
    assert (np.einsum("nc,nc->n", quats[1:], quats[:-1]) < 0).any()
    aligned = without_flips(quats[:, None])[:, 0]
    assert (np.einsum("nc,nc->n", aligned[1:], aligned[:-1]) > 0).all()
    tracks = fit_tracks(times_s, np.zeros((240, 1, 3)), quats[:, None], np.zeros((240, 0)))
    between = np.linspace(0, 2, 1001)
    fitted = tracks.rotations[0](between)
    truth = Rotation.from_rotvec(np.outer(3 * between, [0.0, 0.6, 0.8]))
    off = (Rotation.from_quat(fitted) * truth.inv()).magnitude()
    assert np.degrees(off).max() < 0.15
    assert len(tracks.rotations[0].times_s) < 20


def test_angles_are_those_of_scipy() -> None:
    rng = np.random.default_rng(3)
    a, b = Rotation.random(50, random_state=rng), Rotation.random(50, random_state=rng)
    np.testing.assert_allclose(
        angle_deg(-3 * a.as_quat(), b.as_quat()), np.degrees((a * b.inv()).magnitude()), atol=1e-9
    )


def test_the_report_counts_keys_and_measures_the_error() -> None:
    times_s = np.array([0.0, 1.0, 2.0, 3.0])
    recorded = np.array([[0.0], [1.0], [0.0], [-1.0]])
    curves = fit_curves(times_s, recorded[None], 0.5)
    report = report_keys("weights", "of 1", [(times_s, recorded)], curves)
    assert (report.before, report.after) == (4, len(curves[0].times_s))
    assert report.largest_error == np.abs(curves[0](times_s) - recorded).max() <= 0.5


def test_values_that_are_missing_or_times_that_stand_are_refused() -> None:
    with pytest.raises(ValueError, match="finite"):
        fit_curves(np.arange(3.0), np.array([[[0.0], [np.nan], [0.0]]]), 1.0)
    with pytest.raises(ValueError, match="rise"):
        fit_curves(np.array([0.0, 0.0]), np.zeros((1, 2, 1)), 1.0)


@pytest.mark.skipif(not JAW.exists(), reason="the recorded jaw take is not at hand")
def test_a_real_face_needs_less_than_half_the_keys_of_lines() -> None:
    import ezc3d

    places_mm = np.moveaxis(ezc3d.c3d(str(JAW))["data"]["points"][:3], (1, 2, 0), (0, 1, 2))
    times_s = np.arange(places_mm.shape[1]) / 60
    for tolerance_mm in (0.2, 1.0):
        curves = fit_curves(times_s, places_mm, tolerance_mm)
        report = report_keys("jaw", "mm", [(times_s, places) for places in places_mm], curves)
        lines = sum(len(line_keys(times_s, places, tolerance_mm)) for places in places_mm)
        assert report.largest_error <= tolerance_mm + ROUNDING
        assert report.after < lines / 2
