"""Filling gaps: step, constant, gaps of every length, changing time steps, reset; never a jump, never NaN."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from retarget.markers import Filler
from tests.markers.takes import frame

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

NEUTRAL = np.array([[0.0, 0.0, 0.1], [0.03, 0.02, 0.09], [-0.03, 0.02, 0.09]])
MOVED = NEUTRAL + np.array([0.0, -0.02, 0.0])
GAP = np.full((1, 3), np.nan)


def without_first(places: Array) -> Array:
    return np.concatenate([GAP, places[1:]])


def shown(filler: Filler, places: Sequence[Array], times_s: Sequence[float]) -> Array:
    """(N, M, 3) what the stage makes of a take."""
    return np.array([filler(frame(p, i, t)).positions for i, (p, t) in enumerate(zip(places, times_s, strict=True))])


def test_a_take_without_gaps_passes_as_it_is() -> None:
    filler = Filler(NEUTRAL)
    for i in range(5):
        given_frame = frame(MOVED + i, i)
        assert filler(given_frame) is given_frame
    assert filler.filled == 0


def test_a_lost_marker_holds_then_goes_the_exponential_way_to_neutral() -> None:
    filler = Filler(NEUTRAL, hold_s=0.1, ease_s=0.25)
    times = np.arange(0, 3, 0.01)
    out = shown(filler, [MOVED, *[without_first(MOVED)] * (len(times) - 1)], times.tolist())
    expected = NEUTRAL[0, 1] - 0.02 * np.exp(-np.maximum(times - 0.1, 0) / 0.25)
    np.testing.assert_allclose(out[:, 0, 1], expected, atol=1e-12)
    np.testing.assert_array_equal(out[:, 1:], np.broadcast_to(MOVED[1:], (len(times), 2, 3)))
    assert filler.filled == len(times) - 1


def test_a_marker_that_comes_back_is_eased_in() -> None:
    filler = Filler(NEUTRAL, hold_s=0.1, return_s=0.08)
    times = np.arange(0, 1, 0.005)
    back = 10
    places = [NEUTRAL, *[without_first(NEUTRAL)] * (back - 1), *[MOVED] * (len(times) - back)]
    out = shown(filler, places, times.tolist())[:, 0, 1]
    since = times[back:] - times[back - 1]
    np.testing.assert_allclose(out[back:], -0.02 + 0.02 * np.exp(-since / 0.08), atol=1e-6)


def test_after_the_return_the_measurement_passes_untouched_again() -> None:
    filler = Filler(NEUTRAL)
    shown(filler, [NEUTRAL, without_first(NEUTRAL), MOVED], [0, 0.1, 0.2])
    shown(filler, [MOVED] * 300, (0.3 + np.arange(300) / 60).tolist())
    last = frame(MOVED, 999, 9.0)
    assert filler(last) is last


def test_a_marker_never_seen_stands_at_neutral_and_comes_in_gently() -> None:
    filler = Filler(NEUTRAL)
    out = shown(filler, [without_first(MOVED)] * 5 + [MOVED], (np.arange(6) / 100).tolist())
    np.testing.assert_array_equal(out[:5, 0], np.broadcast_to(NEUTRAL[0], (5, 3)))
    np.testing.assert_array_equal(out[0, 1:], MOVED[1:])  # what is seen from the start is not eased in
    assert 0 < NEUTRAL[0, 1] - out[5, 0, 1] < 0.02 * 0.13


def test_only_a_marker_without_a_neutral_keeps_its_gaps() -> None:
    neutral = NEUTRAL.copy()
    neutral[1] = np.nan
    filler = Filler(neutral)
    gone = np.full((3, 3), np.nan)
    out = shown(filler, [MOVED, gone, MOVED], [0, 0.01, 0.02])
    np.testing.assert_array_equal(np.isnan(out).any(axis=-1), [[0, 0, 0], [0, 1, 0], [0, 0, 0]])
    np.testing.assert_array_equal(out[2, 1], MOVED[1])


def test_a_half_known_position_is_a_gap() -> None:
    places = MOVED.copy()
    places[0, 1] = np.nan
    out = shown(Filler(NEUTRAL), [MOVED, places], [0, 0.01])
    np.testing.assert_array_equal(out[1], MOVED)


@st.composite
def takes_with_gaps(draw: st.DrawFn) -> tuple[Array, Array, Array]:
    """Smooth motion (N, 3, 3), which rows are lost (N, 3), and uneven times (N,), doubled frames among them."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    count = draw(st.integers(2, 120))
    steps = rng.choice([0.0, 0.002, 0.008, 0.0167, 0.1], count)
    times = np.cumsum(steps)
    places = NEUTRAL + 0.02 * np.sin(3 * times[:, None, None] + rng.uniform(0, 6, (1, 3, 3)))
    lost = np.zeros((count, 3), bool)
    for _ in range(draw(st.integers(0, 8))):
        start, length, marker = rng.integers(count), rng.integers(1, 60), rng.integers(3)
        lost[start : start + length, marker] = True
    return places, lost, times


@given(takes_with_gaps())
@settings(deadline=None)
def test_whatever_is_lost_and_whenever_nothing_jumps_or_is_nan(take: tuple[Array, Array, Array]) -> None:
    places, lost, times = take
    out = shown(Filler(NEUTRAL), list(np.where(lost[..., None], np.nan, places)), times.tolist())
    assert np.isfinite(out).all()
    steps = np.diff(times)
    moved = np.linalg.norm(np.diff(out, axis=0), axis=-1)
    own = np.linalg.norm(np.diff(places, axis=0), axis=-1)
    # At most 70 mm to go, and the faster of the two ways takes a share 1 - exp(-dt / 80 ms) of it.
    bound = own + 0.07 * (1 - np.exp(-steps / 0.08))[:, None] + 1e-6
    assert (moved <= bound).all()
    assert (moved[steps == 0] <= 1e-6).all()


@given(takes_with_gaps())
@settings(deadline=None)
def test_what_is_shown_stays_between_where_markers_were_and_neutral(take: tuple[Array, Array, Array]) -> None:
    places, lost, times = take
    out = shown(Filler(NEUTRAL), list(np.where(lost[..., None], np.nan, places)), times.tolist())
    reach = np.abs(places - NEUTRAL).max(axis=(0, 2))
    assert (np.abs(out - NEUTRAL).max(axis=(0, 2)) <= 3 * reach + 1e-9).all()


def test_the_frame_rate_does_not_matter() -> None:
    slow, fast = Filler(NEUTRAL), Filler(NEUTRAL)
    a = shown(slow, [MOVED, *[without_first(MOVED)] * 10], (np.arange(11) * 0.05).tolist())
    b = shown(fast, [MOVED, *[without_first(MOVED)] * 100], (np.arange(101) * 0.005).tolist())
    np.testing.assert_allclose(a, b[::10], atol=1e-12)


@pytest.mark.parametrize(
    "times_s", [[0, 0, 0], [5, 4, 3], [0, 1e9, 2e9], [1e9, 0, 1e9], [-3, math.nextafter(-3, 0), 0]]
)
def test_strange_times_give_sound_positions(times_s: list[float]) -> None:
    filler = Filler(NEUTRAL)
    out = shown(filler, [MOVED, without_first(MOVED), MOVED], times_s)
    assert np.isfinite(out).all()
    assert (np.abs(out - NEUTRAL) <= 0.02 + 1e-12).all()


def test_time_goes_on_after_a_take_that_loops() -> None:
    filler = Filler(NEUTRAL)
    shown(filler, [MOVED, MOVED], [100.0, 100.1])
    out = shown(filler, [MOVED, without_first(MOVED), without_first(MOVED)], [0.0, 0.1, 5.0])
    np.testing.assert_allclose(out[2], np.concatenate([NEUTRAL[:1], MOVED[1:]]), atol=1e-9)


def test_a_reset_stage_answers_as_a_new_one() -> None:
    filler = Filler(NEUTRAL)
    shown(filler, [MOVED, without_first(MOVED)], [0, 0.01])
    filler.reset()
    assert filler.filled == 0
    out = shown(filler, [without_first(MOVED)], [50.0])
    np.testing.assert_array_equal(out[0, 0], NEUTRAL[0])


def test_the_frame_given_is_not_changed_and_the_rest_of_it_passes_through() -> None:
    filler = Filler(NEUTRAL)
    filler(frame(MOVED, 0))
    places = without_first(MOVED)
    item = frame(places.copy(), 3, 0.5)
    out = filler(item)
    np.testing.assert_array_equal(item.positions, places)
    assert (out.number, out.time_s, out.layout, out.T_world_head) == (3, 0.5, item.layout, None)
