"""Known motion goes in, and comes back: the mapping against a performer of whom everything is known."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import pytest

from retarget import geometry
from retarget.markers.c3d import read_c3d
from retarget.markers.fill import Filler
from retarget.markers.layouts import load_layout
from retarget.markers.neutral import StillMoment
from retarget.markers.stabilise import Stabiliser
from retarget.performer import gain_matrix
from retarget.rig.fit import performer_from_neutral
from retarget.rig.joints import JointMapping
from retarget.rig.load import load_rig
from tests.synthetic.capture import captured, with_dropouts, with_noise, with_outliers
from tests.synthetic.demo_take import RATE_HZ, STILL_S, demo_take
from tests.synthetic.face import ALL_SITES, FACE24_SITES, HEAD_BAND, SyntheticFace, face_layout, make_face
from tests.synthetic.motion import everything
from tests.synthetic.places import head_turn, site_places
from tests.synthetic.rig import small_rig

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame, Pose
    from retarget.performer import Performer
    from retarget.rig.model import Rig
    from tests.synthetic.capture import SyntheticTake

    Array = NDArray[np.float64]

DEMO = Path(__file__).parents[1] / "takes" / "demo.c3d"
LAYOUTS = {"face24": face_layout(), "all": face_layout("all", ALL_SITES)}


@dataclass(frozen=True, slots=True, eq=False)
class Score:
    """How far the solved rig is from the truth."""

    joints_m: Array
    """(T, S), distance of each driven joint from its true place."""
    jaw_rad: Array
    """(T,), error of the performer's jaw as it was measured."""
    poses: list[Pose]


def score(take: SyntheticTake, frames: Iterable[MarkerFrame], mapping: JointMapping, rig: Rig) -> Score:
    joints, jaw, poses = [], [], []
    for i, frame in enumerate(frames):
        pose = mapping(frame)
        places = site_places(rig, pose)
        joints.append([np.linalg.norm(places[site] - take.joints[site][i]) for site in mapping.sites])
        jaw.append(mapping.jaw_angle(frame) - take.performer_jaw_rad[i])
        poses.append(pose)
    return Score(np.array(joints), np.array(jaw), poses)


def performance(
    layout: str, seed: int, axes: Literal["plain", "turned"] = "plain", seconds: float = 1.5
) -> tuple[SyntheticFace, SyntheticTake, np.random.Generator]:
    rng = np.random.default_rng(seed)
    face = make_face(small_rig(axes), LAYOUTS[layout], rng)
    return face, captured(face, everything(face.rig, np.arange(round(seconds * 60)) / 60, rng)), rng


def stabiliser(performer: Performer) -> Stabiliser:
    rows = [performer.markers.index(name) for name in performer.head_markers]
    return Stabiliser(performer.head_template, rows)


@pytest.mark.parametrize("axes", ["plain", "turned"])
@pytest.mark.parametrize("layout", ["face24", "all"])
@pytest.mark.parametrize("seed", [1, 2])
def test_with_K_known_joints_and_jaw_come_back(layout: str, axes: Literal["plain", "turned"], seed: int) -> None:
    face, take, _ = performance(layout, seed, axes)
    mapping = JointMapping(face.rig, face.layout, face.performer)
    result = score(take, take.stabilised(), mapping, face.rig)
    assert len(mapping.sites) == {"face24": 20, "all": 41}[layout]
    assert np.degrees(np.ptp(take.performer_jaw_rad)) > 5
    assert result.joints_m.max() < 1e-9
    assert np.degrees(np.abs(result.jaw_rad).max()) < 1e-6


def test_on_the_shipped_rig_the_truth_comes_back_too() -> None:
    rng = np.random.default_rng(9)
    face = make_face(load_rig("human"), LAYOUTS["all"], rng)
    take = captured(face, everything(face.rig, np.arange(60) / 60, rng))
    mapping = JointMapping(face.rig, face.layout, face.performer)
    result = score(take, take.stabilised(), mapping, face.rig)
    assert len(mapping.sites) == 41
    assert result.joints_m.max() < 1e-4
    assert np.degrees(np.abs(result.jaw_rad).max()) < 0.1


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_from_the_room_with_the_head_found_by_its_markers_the_truth_comes_back(seed: int) -> None:
    face, take, _ = performance("all", seed)
    reference = take.T_world_head[0]
    mapping = JointMapping(face.rig, face.layout, face.performer, reference)
    result = score(take, map(stabiliser(face.performer), take.frames()), mapping, face.rig)
    assert result.joints_m.max() < 1e-4
    assert np.degrees(np.abs(result.jaw_rad).max()) < 0.1
    for T_world_head, pose in zip(take.T_world_head, result.poses, strict=True):
        np.testing.assert_allclose(pose.T_world_head, T_world_head, atol=1e-6)
        np.testing.assert_allclose(head_turn(face.rig, pose), reference[:3, :3].T @ T_world_head[:3, :3], atol=1e-6)


def test_the_rigs_jaw_turns_by_the_performers_and_the_gain() -> None:
    face, take, _ = performance("face24", 4)
    result = score(take, take.stabilised(), JointMapping(face.rig, face.layout, face.performer), face.rig)
    assert face.rig.jaw is not None
    jaw = face.rig.jaw.joint
    quats = np.array([pose.rotations[jaw] for pose in result.poses])  # its rest axes are the rig's in this rig
    np.testing.assert_allclose(2 * np.arctan2(quats[:, 0], quats[:, 3]), take.rig_jaw_rad, atol=1e-9)


def test_noise_of_0_3_mm_is_passed_on_and_not_blown_up() -> None:
    face, take, rng = performance("all", 5)
    noisy = with_noise(take, rng, 0.0003)
    mapping = JointMapping(face.rig, face.layout, face.performer)
    result = score(take, map(stabiliser(face.performer), noisy.frames()), mapping, face.rig)
    assert np.sqrt((result.joints_m**2).mean()) < 0.001
    assert np.degrees(np.sqrt((result.jaw_rad**2).mean())) < 0.35


@pytest.mark.parametrize("seed", [6, 7])
def test_dropouts_and_outliers_never_make_nan_and_never_a_face_that_comes_apart(seed: int) -> None:
    face, take, rng = performance("all", seed)
    rough = with_outliers(with_dropouts(with_noise(take, rng, 0.0003), rng, 0.1), rng, 0.05)
    assert 0.07 < np.isnan(rough.p_world).any(axis=2).mean() < 0.13
    stabilise, fill = stabiliser(face.performer), Filler(face.performer.neutral)
    mapping = JointMapping(face.rig, face.layout, face.performer)
    frames = (fill(stabilise(frame)) for frame in rough.frames())
    result = score(take, frames, mapping, face.rig)
    for pose in result.poses:
        assert all(np.isfinite(a).all() for a in (pose.translations, pose.rotations, pose.T_world_head))
    assert np.median(result.joints_m) < 0.001
    assert result.joints_m.max() < 0.06


@pytest.mark.parametrize("seed", range(4))
def test_without_calibration_the_face_still_moves_like_the_performer(seed: int) -> None:
    """No performer file: the neutral gives size, head and hinge. The hinge is a few millimetres and degrees off, and
    the gain of the jaw up to a quarter, so the joints are off by a share of how far they move, and nothing worse.
    """
    face, take, rng = performance("all", seed)
    scale = face.performer.scale
    face = replace(face, performer=replace(face.performer, K={site: gain_matrix(scale) for site in ALL_SITES}))
    take = captured(face, everything(face.rig, take.times, rng))
    neutral_world = geometry.apply(take.T_world_head[0], face.performer.neutral)
    performer, reference = performer_from_neutral(face.layout, neutral_world, face.rig)
    mapping = JointMapping(face.rig, face.layout, performer, reference)
    result = score(take, map(stabiliser(performer), take.frames()), mapping, face.rig)
    way = np.array([np.linalg.norm(take.joints[s] - face.rig.sites[s].rest, axis=1) for s in mapping.sites])
    assert np.sqrt((result.joints_m**2).mean()) < 0.25 * np.sqrt((way**2).mean())
    assert result.joints_m.max() < 0.008
    assert np.degrees(np.sqrt((result.jaw_rad**2).mean())) < 1.0


def test_the_demo_take_is_what_its_recipe_makes() -> None:
    clip, take = read_c3d(DEMO), demo_take()
    assert clip.rate_hz == RATE_HZ
    assert clip.layout.names == take.layout.names
    np.testing.assert_allclose(clip.positions, take.p_world, atol=1e-6)
    assert DEMO.stat().st_size < 1_000_000


def test_the_demo_take_has_the_markers_of_the_shipped_layout() -> None:
    assert set(load_layout("face24").markers.names) == {*HEAD_BAND, *FACE24_SITES} == set(demo_take().layout.names)


def test_the_demo_take_starts_still_and_then_does_what_it_says() -> None:
    take = demo_take()
    still = StillMoment()
    found = next(neutral for frame in take.frames() if (neutral := still.feed(frame)))
    assert found.still
    assert found.last_number < STILL_S * RATE_HZ

    def moved(site: str, second: float) -> Array:
        path = take.joints[site]
        change: Array = 1000 * (path[round(second * RATE_HZ)] - path[0])
        return change  # mm

    assert moved("browMidLeft", 1.8)[1] > 6
    assert moved("lipCornerLeft", 3.3)[0] > 6
    assert moved("lipCornerRight", 3.3)[0] < -6
    assert moved("chin", 8.6)[1] < -20
    assert np.abs(moved("browMidLeft", 3.3)).max() < 2
    speech = np.degrees(take.rig_jaw_rad[round(4.6 * RATE_HZ) : round(7.4 * RATE_HZ)])
    assert ((speech[1:-1] > speech[:-2]) & (speech[1:-1] > speech[2:]) & (speech[1:-1] > 2)).sum() >= 8
    assert np.isnan(take.p_world).any()


def test_the_same_seed_gives_the_same_performance_and_another_seed_another() -> None:
    first, again, other = (performance("face24", seed)[1].p_world for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.001


def test_faces_differ_from_the_rig_by_millimetres_and_have_gains_of_their_own() -> None:
    for seed in range(10):
        face = make_face(small_rig(), LAYOUTS["all"], np.random.default_rng(seed))
        rests = np.array([face.rig.sites[site].rest for site in ALL_SITES])
        away = np.linalg.norm(face.performer.scale * face.performer.neutral[len(HEAD_BAND) :] - rests, axis=1)
        assert 0.001 < np.median(away) < 0.015
        ratios = np.array([np.diag(K) for K in face.performer.K.values()]) / face.performer.scale
        assert 0.5 <= ratios.min() < ratios.max() <= 1.0
