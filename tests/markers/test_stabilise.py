"""Stabilising: known head motion, real motion, a real face; and a lost head never shakes the face."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.frames import MarkerFrame
from retarget.geometry import apply, inverse, kabsch, transform
from retarget.markers import Labeller, Stabiliser, StillMoment, detect_layout, load_layout, read_c3d
from tests.markers.takes import EYEBROWS, HEADBAND, JAW, frame, frames, motion, recording

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

BAND = load_layout("face24").markers


def band_rest() -> Array:
    assert BAND.rest is not None
    return BAND.rest


def stabilised(name: str) -> tuple[dict[str, Array], Stabiliser]:
    """Distance of each marker of a real take from its neutral [m] (N,), in the head's frame."""
    clip = read_c3d(recording(name))
    layout = detect_layout(clip.layout.names)
    labelled = [Labeller(layout)(f) for f in clip]
    still = StillMoment()
    neutral = next(found for found in map(still.feed, labelled) if found is not None)
    head = list(layout.markers.head)
    stage = Stabiliser(neutral.positions[head], head)
    off = np.linalg.norm([stage(f).positions - neutral.positions for f in labelled], axis=-1)
    return dict(zip(layout.markers.sites, off.T, strict=True)), stage


def rms(values: Array) -> float:
    return float(np.sqrt((values**2).mean()))


def test_the_heads_motion_is_gone_from_a_real_face_whose_jaw_opens() -> None:
    off, stage = stabilised(JAW)
    for site in ("forehead", "foreheadLeft", "foreheadRight"):
        assert rms(off[site]) < 0.0005, site
    assert off["chin"][5] < 0.002
    assert off["chin"][420] > 0.035
    assert (stage.coasting_frames, stage.swapped_frames) == (0, 0)


def test_real_brows_do_not_tilt_the_head_so_the_mouth_stays() -> None:
    off, _ = stabilised(EYEBROWS)
    assert off["browMidLeft"].max() > 0.012
    assert rms(off["noseTip"]) < 0.001
    assert off["noseTip"].max() < 0.0018
    assert off["chin"].max() < 0.006  # least squares over the same markers: 0.0074


def test_a_real_head_band_is_followed_from_its_template() -> None:
    clip = read_c3d(recording(HEADBAND))
    layout = load_layout("face24")
    labelled = [Labeller(layout)(f) for f in clip]
    head = list(layout.markers.head)
    assert np.isnan(labelled[0].positions[head]).any()
    template = labelled[100].positions[head]
    stage = Stabiliser(template, head)
    out = np.array([stage(f).positions[head] for f in labelled])
    seen = np.isfinite(out).all(axis=-1)
    assert seen.sum(axis=1).min() == 3
    residuals = np.linalg.norm(out - template, axis=-1)[seen]
    assert rms(residuals) < 0.0025  # this band gives: the distances between its markers vary by 2.6 mm
    assert stage.coasting_frames == 0


def test_a_real_heads_motion_carried_onto_a_real_face_is_recovered() -> None:
    """41 face markers of one recording on the head band of another, so that the truth is known."""
    walk, face = read_c3d(recording(HEADBAND)), read_c3d(recording(JAW))
    names = walk.layout.names
    band = walk.positions[:, [names.index(n) for n in ("LFHD", "RFHD", "LBHD", "RBHD")]]
    band = band[np.isfinite(band).all(axis=(1, 2))]
    truth = [kabsch(band[0], places) for places in band]  # T_world_start
    n = len(truth)
    # The face, its own head motion taken out, rides on the band.
    forehead = [face.layout.names.index(f"ForeHead_{side}") for side in "MLR"]
    start = face.positions[0, forehead]
    steady = [apply(inverse(kabsch(start, p[forehead])), p) for p in face.positions[300 : 300 + n]]
    together = np.array([apply(T, np.concatenate([band[0], p])) for T, p in zip(truth, steady, strict=True)])
    stage = Stabiliser(band[0], range(4))
    for T, f, expected in zip(truth, frames(together), steady, strict=True):
        out = stage(f)
        assert out.T_world_head is not None
        np.testing.assert_allclose(out.T_world_head, T, atol=1e-9)
        np.testing.assert_allclose(out.positions[4:], expected, atol=1e-9)


def test_noise_on_the_band_becomes_little_noise_on_the_chin() -> None:
    rng = np.random.default_rng(0)
    rest = band_rest()
    stage = Stabiliser(rest[:4], range(4))
    errors = []
    for i in range(200):
        noisy = apply(motion(np.random.default_rng(1), 1, 1), rest)
        noisy[:4] += rng.normal(size=(4, 3)) * 2e-4
        errors.append(np.linalg.norm(stage(frame(noisy, i)).positions[-1] - rest[-1]))
    assert np.sqrt(np.mean(np.square(errors))) < 5e-4


def test_a_band_marker_that_strays_by_20_mm_for_a_while_leaves_the_face_alone() -> None:
    rng = np.random.default_rng(2)
    rest = band_rest().copy()
    rest[3] = rest[1] + rest[2] - rest[0]  # quite flat, so that no frame alone can tell which marker has left the plane
    normal = np.cross(rest[1] - rest[0], rest[2] - rest[0])
    normal /= np.linalg.norm(normal)
    for marker in range(4):
        stage = Stabiliser(rest[:4], range(4))
        for i in range(60):
            T = motion(np.random.default_rng(3), 1, 1)
            places = apply(T, rest) + rng.normal(size=rest.shape) * 3e-4
            if 20 <= i < 40:
                places[marker] += T[:3, :3] @ (0.02 * normal)
            out = stage(frame(places, i))
            assert (
                np.linalg.norm(out.positions[4:] - rest[4:], axis=1).max() < 0.004
            )  # without a memory of the head: 0.032


@pytest.mark.parametrize("shown", [2, 1, 0])
def test_a_short_loss_of_the_band_in_even_motion_hardly_moves_the_face(shown: int) -> None:
    rest = band_rest()
    stage = Stabiliser(rest[:4], range(4))
    worst = 0.0
    for i in range(120):
        T = np.eye(4)
        angle = 0.5 * i / 120
        T[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
        T[:3, 3] = [0.2 * i / 120, 1.5, 0]
        places = apply(T, rest)
        if 100 <= i < 105:
            places[shown:4] = np.nan
        out = stage(frame(places, i, i / 120))
        worst = max(worst, float(np.linalg.norm(out.positions[4:] - rest[4:], axis=1).max()))
    assert stage.coasting_frames == 5
    assert worst < 0.006  # it would be 30 mm if the head stood still
    if shown == 2:
        assert worst < 0.003


def test_a_long_loss_of_the_band_blanks_the_face_and_the_head_rests() -> None:
    rest = band_rest()
    stage = Stabiliser(rest[:4], range(4))
    poses = []
    for i in range(100):
        places = rest + np.array([0.01 * i / 5, 0, 0])
        if 50 <= i < 90:
            places[:4] = np.nan
        out = stage(frame(places, i))
        assert out.T_world_head is not None
        poses.append(out.T_world_head)
        blank = np.isnan(out.positions).all()
        assert bool(blank) == (60 <= i < 90)
    np.testing.assert_allclose(poses[89], poses[80], atol=1e-4)
    np.testing.assert_allclose(poses[90], transform(np.eye(3), [0.18, 0, 0]), atol=1e-9)


def test_a_pair_of_markers_turns_the_head_with_it() -> None:
    rest = band_rest()
    stage = Stabiliser(rest[:4], range(4))
    stage(frame(rest, 0))
    T = motion(np.random.default_rng(5), 0.3)
    places = apply(T, rest)
    places[2:4] = np.nan
    out = stage(frame(places, 1))
    assert out.T_world_head is not None
    direction = out.T_world_head[:3, :3] @ (rest[1] - rest[0])
    np.testing.assert_allclose(direction, T[:3, :3] @ (rest[1] - rest[0]), atol=1e-9)
    np.testing.assert_allclose(out.positions[:2].mean(axis=0), rest[:2].mean(axis=0), atol=1e-9)


def test_three_markers_on_one_line_are_no_measurement_of_the_turn() -> None:
    rest = np.array([[-0.05, 0.1, 0.1], [0, 0.1, 0.1], [0.05, 0.1, 0.1], [0, 0, 0.1]])
    stage = Stabiliser(rest, range(4))
    stage(frame(rest, 0))
    places = rest.copy()
    places[3] = np.nan
    out = stage(frame(places, 1))
    assert stage.coasting_frames == 1
    np.testing.assert_allclose(out.positions[:3], rest[:3], atol=1e-9)


def test_before_the_head_was_seen_nothing_is_measured() -> None:
    rest = band_rest()
    places = rest.copy()
    places[1:4] = np.nan
    out = Stabiliser(rest[:4], range(4))(frame(places))
    assert np.isnan(out.positions).all()
    np.testing.assert_array_equal(out.T_world_head, np.eye(4))


def test_exchanged_band_markers_are_put_right_in_the_frame_and_reported_once(caplog: pytest.LogCaptureFixture) -> None:
    rest = band_rest()
    stage = Stabiliser(rest[:4], range(4))
    with caplog.at_level(logging.WARNING, "retarget.markers"):
        for i in range(10):
            places = rest + np.array([0, 1.5, 0])
            if i >= 5:
                places[[0, 2]] = places[[2, 0]]
            out = stage(frame(places, i, markers=BAND))
            np.testing.assert_allclose(out.positions, rest, atol=1e-9)
    assert stage.swapped_frames == 5
    assert [r.getMessage() for r in caplog.records] == [
        "Frame 5: head markers have exchanged their names: headFrontLeft, headBackLeft"
    ]


def test_unknown_template_rows_are_left_out_and_too_few_are_refused() -> None:
    rest = band_rest()[:4].copy()
    rest[1] = np.nan
    out = Stabiliser(rest, range(4))(frame(band_rest()))
    np.testing.assert_allclose(out.positions, band_rest(), atol=1e-9)
    rest[2] = np.nan
    with pytest.raises(InputError, match="Only 2 of the head's markers"):
        Stabiliser(rest, range(4))
    with pytest.raises(InputError, match="on one line"):
        Stabiliser(np.outer(np.arange(4), [0.03, 0.01, 0]), range(4))


def test_a_reset_stage_answers_as_a_new_one() -> None:
    rng = np.random.default_rng(6)
    rest = band_rest()
    takes = [frame(apply(motion(rng), rest) + rng.normal(size=rest.shape) * 3e-3, i) for i in range(20)]
    stage = Stabiliser(rest[:4], range(4))
    first = [stage(f).positions for f in takes]
    stage.reset()
    np.testing.assert_array_equal([stage(f).positions for f in takes], first)


def test_the_frame_given_is_not_changed_and_the_rest_of_it_passes_through() -> None:
    rest = band_rest()
    stray = np.ones((1, 3))
    places = rest + 1
    before = places.copy()
    out = Stabiliser(rest[:4], range(4))(MarkerFrame(7, 1.5, 2.5, BAND, places, None, stray))
    np.testing.assert_array_equal(places, before)
    assert (out.number, out.time_s, out.received_s, out.layout, out.unlabelled) == (7, 1.5, 2.5, BAND, stray)


def test_doubled_and_late_frames_do_no_harm() -> None:
    rest = band_rest()
    stage = Stabiliser(rest[:4], range(4))
    for time_s in (0.0, 0.01, 0.01, 0.005, 0.02, 100.0, 0.0):
        out = stage(frame(rest + time_s, 0, time_s))
        np.testing.assert_allclose(out.positions, rest, atol=1e-9)
