"""Reading the jaw: known turns, the published law, and where they part."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget import geometry
from retarget.performer import PerformerJaw
from retarget.rig.jaw import cosine_angle, jaw_reader, signed_angle

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.performer import JawMode

    Array = NDArray[np.float64]

AXIS = np.array([1.0, 0.0, 0.0])
PIVOT = np.array([0.0, 0.06, 0.01])
CHIN = np.array([[0.0, 0.01, 0.09]])
LEVER = CHIN - PIVOT
"""94 mm."""
CHINS = np.array([[0.0, -0.015, 0.09], [0.02, -0.012, 0.083], [-0.02, -0.012, 0.083]])


def turned(points: Array, angle: float) -> Array:
    R = geometry.matrix_from_quat(geometry.quat_from_axis_angle(AXIS, angle))
    back: Array = (points - PIVOT) @ R.T + PIVOT
    return back


def reading(rest: Array, now: Array, mode: JawMode = "signed") -> float:
    return jaw_reader(PerformerJaw(AXIS, PIVOT, 1.0, -0.1, 0.6, mode), rest)(now)


@given(st.floats(-3.1, 3.1))
def test_the_signed_angle_is_the_turn_with_its_sign(angle: float) -> None:
    assert float(signed_angle(LEVER, turned(CHIN, angle) - PIVOT, AXIS)) == pytest.approx(angle, abs=1e-12)
    assert reading(CHIN, turned(CHIN, angle)) == pytest.approx(angle, abs=1e-12)


@given(st.floats(-3.1, 3.1))
def test_the_cosine_law_reads_closing_as_opening(angle: float) -> None:
    assert reading(CHIN, turned(CHIN, angle), "cosine") == pytest.approx(abs(angle), abs=1e-7)


def test_the_cosine_law_agrees_with_the_arc_cosine_of_the_textbook() -> None:
    rng = np.random.default_rng(1)
    u, v = rng.normal(size=(2, 200, 3))
    textbook = np.arccos((u * v).sum(axis=1) / np.linalg.norm(u, axis=1) / np.linalg.norm(v, axis=1))
    np.testing.assert_allclose(cosine_angle(u, v), textbook, atol=1e-9)


def test_the_cosine_law_keeps_small_angles_that_the_arc_cosine_loses() -> None:
    angle = 1e-8
    u, v = LEVER[0], turned(CHIN, angle)[0] - PIVOT
    a, b, c = (float(np.linalg.norm(side)) for side in (u, v, v - u))
    assert math.acos(min((a**2 + b**2 - c**2) / (2 * a * b), 1.0)) < 0.1 * angle
    assert float(cosine_angle(u, v)) == pytest.approx(angle, rel=1e-3)


def test_a_sideways_slide_of_10_mm_at_10_degrees_reads_10_signed_and_11_67_by_the_cosine_law() -> None:
    slid = turned(CHIN, math.radians(10)) + np.array([0.01, 0.0, 0.0])
    assert math.degrees(reading(CHIN, slid)) == pytest.approx(10.0, abs=1e-9)
    assert math.degrees(reading(CHIN, slid, "cosine")) == pytest.approx(11.67, abs=0.005)


def test_noise_at_rest_reads_as_an_open_mouth_only_by_the_cosine_law() -> None:
    rng = np.random.default_rng(2)
    v = LEVER + rng.normal(scale=0.0003, size=(20_000, 3))
    assert np.degrees(signed_angle(LEVER, v[:, None], AXIS)).mean() == pytest.approx(0.0, abs=0.005)
    assert np.degrees(cosine_angle(LEVER, v)).mean() == pytest.approx(0.227, abs=0.01)


def test_several_markers_give_the_turn_that_fits_them_all_best() -> None:
    rng = np.random.default_rng(3)
    now = turned(CHINS, 0.3) + rng.normal(scale=0.001, size=CHINS.shape)
    angles = np.linspace(0.2, 0.4, 20_001)
    errors = [float(((turned(CHINS, a) - now) ** 2).sum()) for a in angles]
    assert reading(CHINS, now) == pytest.approx(angles[np.argmin(errors)], abs=2e-5)


@pytest.mark.parametrize("mode", ["signed", "cosine"])
def test_a_marker_that_is_not_seen_is_left_out(mode: JawMode) -> None:
    now = turned(CHINS, 0.2)
    now[0] = np.nan
    assert reading(CHINS, now, mode) == pytest.approx(0.2)
    assert float(signed_angle(CHINS - PIVOT, now - PIVOT, AXIS)) == pytest.approx(0.2)


@pytest.mark.parametrize("mode", ["signed", "cosine"])
@pytest.mark.parametrize("now", [np.full((1, 3), np.nan), PIVOT[None], PIVOT[None] + [1e-6, 1e-6, 0.0]])
def test_without_a_marker_or_a_lever_there_is_no_reading(now: Array, mode: JawMode) -> None:
    assert math.isnan(reading(CHIN, now, mode))


def test_a_chin_on_the_axis_says_nothing_of_the_turn() -> None:
    on_axis = PIVOT[None] + [0.05, 0.0, 0.0]
    assert math.isnan(reading(on_axis, on_axis))
    assert np.isnan(signed_angle(on_axis - PIVOT, on_axis - PIVOT, AXIS))


def test_batches_and_single_frames_agree() -> None:
    angles = np.linspace(-0.1, 0.5, 7)
    now = np.stack([turned(CHINS, a) for a in angles])
    np.testing.assert_allclose(signed_angle(CHINS - PIVOT, now - PIVOT, AXIS), angles, atol=1e-12)
    np.testing.assert_allclose([reading(CHINS, p) for p in now], angles, atol=1e-12)
