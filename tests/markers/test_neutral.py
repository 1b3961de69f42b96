"""The neutral face: on the real takes the mouth is shut, synthetic ones give it back, and bad starts come to an end."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.geometry import apply, kabsch
from retarget.markers import Labeller, Neutral, StillMoment, detect_layout, load_layout, read_c3d
from retarget.markers.neutral import without_rigid_motion
from tests.markers.takes import EYEBROWS, JAW, frames, motion, recording

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame

    Array = NDArray[np.float64]


def rest() -> Array:
    places = load_layout("face24").markers.rest
    assert places is not None
    return places


def found_in(takes: Iterable[MarkerFrame], still: StillMoment) -> tuple[Neutral | None, int]:
    """The neutral, and how many frames were fed until then."""
    fed = 0
    for fed, item in enumerate(takes, 1):
        found = still.feed(item)
        if found is not None:
            return found, fed
    return None, fed


def aligned_error(found: Array, truth: Array) -> float:
    """Largest distance of a marker from its truth, the rigid motion aside [m]."""
    seen = np.isfinite(found).all(axis=1)
    return float(np.linalg.norm(apply(kabsch(truth[seen], found[seen]), truth[seen]) - found[seen], axis=1).max())


@pytest.mark.parametrize("name", [JAW, EYEBROWS])
def test_the_neutral_of_a_real_take_has_the_mouth_shut(name: str) -> None:
    clip = read_c3d(recording(name))
    layout = detect_layout(clip.layout.names)
    found, fed = found_in(map(Labeller(layout), clip), StillMoment())
    assert found is not None
    assert found.still
    assert (found.first_number, found.last_number, fed) == (0, 29, 30)
    upper, lower = (layout.markers.sites.index(site) for site in ("lipUpper", "lipLower"))
    gap = np.linalg.norm(found.positions[upper] - found.positions[lower])
    assert gap < 0.040  # between the markers on the lips; 80 mm where the jaw is wide open
    assert 0.0001 < np.median(found.spread_m) < 0.0005


def test_a_moving_head_does_not_hide_a_still_face_and_the_first_pose_is_kept() -> None:
    rng = np.random.default_rng(0)
    start, step = motion(rng), motion(rng, 0.02, 0.01)
    poses = [start]
    while len(poses) < 40:
        poses.append(poses[-1] @ step)
    found, fed = found_in(frames(np.array([apply(T, rest()) for T in poses])), StillMoment())
    assert found is not None
    assert fed == 30
    np.testing.assert_allclose(found.positions, apply(start, rest()), atol=1e-9)
    np.testing.assert_allclose(found.spread_m, 0, atol=1e-9)


def test_a_face_that_moves_at_first_is_neutral_only_once_it_rests() -> None:
    rng = np.random.default_rng(1)
    take = np.tile(rest(), (200, 1, 1)) + rng.normal(size=(200, 24, 3)) * 1e-4
    take[:100, -1, 1] -= 0.02 * np.abs(np.sin(np.arange(100) / 8))
    found, _ = found_in(frames(take), StillMoment())
    assert found is not None
    assert found.first_number > 85
    assert aligned_error(found.positions, rest()) < 0.003


def test_one_lip_that_moves_is_not_still_though_the_face_as_a_whole_nearly_is() -> None:
    take = np.tile(rest(), (60, 1, 1))
    take[:, -1, 1] -= np.linspace(0, 0.024, 60)
    assert found_in(frames(take), StillMoment())[0] is None


def test_noise_shows_as_spread() -> None:
    rng = np.random.default_rng(2)
    sigma = rng.uniform(1e-4, 3e-4, 24)
    take = rest() + rng.normal(size=(200, 24, 3)) * sigma[:, None]
    found, _ = found_in(frames(take), StillMoment(window=200))
    assert found is not None
    np.testing.assert_allclose(found.spread_m, sigma * np.sqrt(3), rtol=0.2)  # the fit of the head takes a little away


def test_gaps_leave_their_marker_out_or_are_passed_over() -> None:
    rng = np.random.default_rng(3)
    take = rest() + rng.normal(size=(30, 24, 3)) * 1e-4
    take[:, 7] = np.nan
    take[5:15, 8] = np.nan
    found, _ = found_in(frames(take), StillMoment())
    assert found is not None
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(found.positions).any(axis=1)), [7])
    np.testing.assert_array_equal(np.isnan(found.spread_m), np.isnan(found.positions[:, 0]))
    assert aligned_error(found.positions, rest()) < 5e-4


def test_a_window_that_shows_too_few_of_the_known_markers_is_not_taken() -> None:
    take = np.tile(rest(), (80, 1, 1))
    take[1:40, 5:] = np.nan
    found, fed = found_in(frames(take), StillMoment())
    assert found is not None
    assert (found.first_number, fed) == (40, 70)


def test_frames_before_the_performer_comes_into_view_do_not_count() -> None:
    take = np.tile(rest(), (100, 1, 1))
    take[:60] = np.nan
    found, fed = found_in(frames(take), StillMoment(give_up=50))
    assert found is not None
    assert (found.still, fed) == (True, 90)


def test_after_patience_the_quietest_window_is_taken_with_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    take = np.tile(rest(), (200, 1, 1))
    swing = np.where(np.abs(np.arange(200) - 100) < 20, 0.008, 0.03)
    take[:, -1, 1] -= swing * np.sin(np.arange(200) / 3)
    with caplog.at_level(logging.WARNING, "retarget.markers"):
        found, fed = found_in(frames(take), StillMoment(give_up=180))
    assert found is not None
    assert fed == 180
    assert not found.still
    assert 80 < found.first_number < found.last_number < 120
    assert "never held still" in caplog.text


def test_a_take_shorter_than_the_window_gives_what_it_has() -> None:
    still = StillMoment()
    for item in frames(np.tile(rest(), (4, 1, 1))):
        assert still.feed(item) is None
    found = still.settle()
    assert (found.first_number, found.last_number, found.still) == (0, 3, False)
    np.testing.assert_allclose(found.positions, rest(), atol=1e-9)


def test_markers_that_flicker_never_together_still_come_to_an_end() -> None:
    take = np.tile(rest(), (50, 1, 1))
    for i in range(50):
        take[i, np.arange(24) % 8 != i % 8] = np.nan
    found, fed = found_in(frames(take), StillMoment(give_up=40))
    assert found is not None
    assert fed == 40
    assert np.isfinite(found.positions).all(axis=1).sum() == 3


def test_nothing_seen_is_an_error() -> None:
    still = StillMoment()
    with pytest.raises(InputError, match="three known markers"):
        still.settle()
    for item in frames(np.full((3, 24, 3), np.nan)):
        still.feed(item)
    with pytest.raises(InputError, match="three known markers"):
        still.settle()


def test_a_reset_search_answers_as_a_new_one() -> None:
    still = StillMoment()
    found_in(frames(np.tile(rest(), (30, 1, 1))), still)
    still.reset()
    assert found_in(frames(np.tile(rest(), (29, 1, 1))), still)[0] is None


def test_the_same_frames_at_another_speed_give_the_same_neutral() -> None:
    clip = read_c3d(recording(JAW)).positions[:40]
    (slow, _), (fast, _) = (found_in(frames(clip, rate_hz=rate), StillMoment()) for rate in (60, 240))
    assert slow is not None
    assert fast is not None
    np.testing.assert_array_equal(slow.positions, fast.positions)


def test_laying_frames_onto_the_first_is_kabsch_for_each() -> None:
    rng = np.random.default_rng(4)
    take = np.array([apply(motion(rng, 3), rest()) for _ in range(20)]) + rng.normal(size=(20, 24, 3)) * 5e-3
    four = np.arange(24) < 4  # a head band, so flat that noise can turn it inside out
    for common in (np.arange(24) % 3 > 0, four):
        laid = without_rigid_motion(take, common)
        for places, out in zip(take, laid, strict=True):
            np.testing.assert_allclose(out, apply(kabsch(places[common], take[0, common]), places), atol=1e-9)
