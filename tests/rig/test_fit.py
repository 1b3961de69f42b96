"""A performer out of a still face: known similarity, other people's faces, wrong names, and what is refused."""

from __future__ import annotations

import datetime
import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget import geometry
from retarget.errors import InputError
from retarget.performer import load_performer, save_performer
from retarget.rig.fit import performer_from_neutral
from retarget.rig.joints import JointMapping
from tests.synthetic.face import ALL_SITES, HEAD_BAND, face_layout, make_face
from tests.synthetic.rig import small_rig

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

RIG = small_rig()
LAYOUT = face_layout()
FACE = slice(len(HEAD_BAND), None)
SCALE = 0.9
"""The rig's size over that of `enlarged`."""
T_WORLD_HEAD = geometry.transform(
    geometry.matrix_from_quat(geometry.quat_from_axis_angle(np.array([1, 2, -2]) / 3, 1.1)), [1.0, 1.6, -0.4]
)


def enlarged() -> Array:
    """(M, 3) [m], ``world``: the rig's own face at another size, somewhere in the room."""
    named = zip(LAYOUT.names, LAYOUT.sites, strict=True)
    places = [RIG.sites[site].rest if site else np.array(HEAD_BAND[n]) for n, site in named]
    return geometry.apply(T_WORLD_HEAD, np.array(places) / SCALE)


def test_size_and_head_of_the_rigs_own_face_are_found_exactly() -> None:
    performer, T_world_head = performer_from_neutral(LAYOUT, enlarged(), RIG)
    assert performer.scale == pytest.approx(SCALE)
    np.testing.assert_allclose(T_world_head, T_WORLD_HEAD, atol=1e-12)
    rests = [RIG.sites[site].rest for site in LAYOUT.sites if site]
    np.testing.assert_allclose(performer.scale * performer.neutral[FACE], rests, atol=1e-12)


def test_the_defaults_are_the_size_ratio_for_every_K_and_the_rigs_hinge() -> None:
    day = datetime.date(2026, 5, 6)
    noise = np.full(len(LAYOUT.names), 1e-4)
    performer, _ = performer_from_neutral(LAYOUT, enlarged(), RIG, name="ana", date=day, noise=noise)
    assert (performer.name, performer.rig, performer.layout, performer.date) == ("ana", "small", "face24", day)
    assert set(performer.K) == {site for site in LAYOUT.sites if site}
    for K in performer.K.values():
        np.testing.assert_allclose(K, SCALE * np.eye(3))
    assert performer.jaw is not None
    assert RIG.jaw is not None
    np.testing.assert_allclose(performer.jaw.pivot, RIG.jaw.pivot / SCALE)
    np.testing.assert_array_equal(performer.jaw.axis, RIG.jaw.axis)
    assert (performer.jaw.gain, performer.jaw.min_rad, performer.jaw.max_rad) == (1, RIG.jaw.min_rad, RIG.jaw.max_rad)
    np.testing.assert_array_equal(performer.noise, noise)
    assert performer.head_markers == tuple(HEAD_BAND)
    np.testing.assert_allclose(performer.head_template, np.array([*HEAD_BAND.values()]) / SCALE, atol=1e-12)


def test_without_a_date_it_is_today_and_without_noise_it_is_not_known() -> None:
    performer, _ = performer_from_neutral(LAYOUT, enlarged(), RIG)
    assert abs((performer.date - datetime.date.today()).days) <= 1
    assert np.isnan(performer.noise).all()


@pytest.mark.parametrize("seed", range(5))
def test_other_faces_are_fitted_to_their_size_within_some_per_cent(seed: int) -> None:
    face = make_face(RIG, LAYOUT, np.random.default_rng(seed))
    world = geometry.apply(T_WORLD_HEAD, face.performer.neutral)
    performer, T_world_head = performer_from_neutral(LAYOUT, world, RIG)
    assert performer.scale == pytest.approx(face.performer.scale, rel=0.08)
    R_off = T_WORLD_HEAD[:3, :3].T @ T_world_head[:3, :3]
    assert math.degrees(math.acos(min((np.trace(R_off) - 1) / 2, 1.0))) < 4


def test_three_markers_with_wrong_names_hardly_shift_the_fit() -> None:
    face = make_face(RIG, LAYOUT, np.random.default_rng(3))
    right = face.performer.neutral
    wrong = right.copy()
    a, b, c = (LAYOUT.names.index(n) for n in ("chin", "browOuterLeft", "lipCornerRight"))
    wrong[[a, b, c]] = right[[b, c, a]]
    (_, T_right), (_, T_wrong) = (performer_from_neutral(LAYOUT, p, RIG) for p in (right, wrong))
    untouched = np.delete(np.arange(len(right)), [a, b, c])
    away = geometry.apply(geometry.inverse(T_right) @ T_wrong, right[untouched]) - right[untouched]
    assert np.linalg.norm(away, axis=1).max() < 0.003
    plain, _ = geometry.umeyama(wrong[FACE], np.array([RIG.sites[s].rest for s in LAYOUT.sites[FACE]]))
    assert np.linalg.norm(geometry.inverse(plain)[:3, 3] - T_right[:3, 3]) > 0.005  # least squares alone is led astray


def test_markers_that_are_not_seen_are_left_out_and_have_no_neutral() -> None:
    world = enlarged()
    gone = [0, 7, 12]
    world[gone] = np.nan
    performer, T_world_head = performer_from_neutral(LAYOUT, world, RIG)
    np.testing.assert_allclose(T_world_head, T_WORLD_HEAD, atol=1e-9)
    assert np.flatnonzero(np.isnan(performer.neutral).all(axis=1)).tolist() == gone
    assert LAYOUT.sites[7] not in performer.K


def test_a_rig_that_lacks_some_of_the_sites_is_fitted_by_the_others() -> None:
    few = ("noseBridge", "chin", "lipCornerLeft", "lipCornerRight", "browMidLeft")
    rig = replace(RIG, sites={name: RIG.sites[name] for name in few})
    performer, T_world_head = performer_from_neutral(LAYOUT, enlarged(), rig)
    np.testing.assert_allclose(T_world_head, T_WORLD_HEAD, atol=1e-9)
    assert set(performer.K) == set(few)


def test_a_rig_without_a_jaw_gives_a_performer_without_one() -> None:
    performer, _ = performer_from_neutral(LAYOUT, enlarged(), replace(RIG, jaw=None))
    assert performer.jaw is None


def test_the_performer_maps_its_own_neutral_to_the_rest_and_survives_its_file(tmp_path: Path) -> None:
    layout = face_layout("all", ALL_SITES)
    face = make_face(RIG, layout, np.random.default_rng(1))
    performer, _ = performer_from_neutral(layout, face.performer.neutral, RIG)
    save_performer(performer, tmp_path / "ana.toml")
    loaded = load_performer(tmp_path / "ana.toml")
    np.testing.assert_allclose(loaded.neutral, performer.neutral, atol=1e-7)
    assert set(JointMapping(RIG, layout, loaded).sites) == set(ALL_SITES)


@pytest.mark.parametrize("keep", [[], ["chin"], ["chin", "noseBridge", "lipUpper"]])
def test_too_few_markers_are_refused_with_those_seen_and_those_expected(keep: list[str]) -> None:
    world = enlarged()
    world[[name not in keep for name in LAYOUT.names]] = np.nan
    seen = ", ".join(n for n in LAYOUT.names if n in keep) or "none"
    with pytest.raises(InputError, match=rf"4 or more sites .* seen are {seen}; .* forehead, browCenter"):
        performer_from_neutral(LAYOUT, world, RIG)


def test_a_layout_that_knows_nothing_of_the_rig_is_refused() -> None:
    with pytest.raises(InputError, match="4 or more sites"):
        performer_from_neutral(replace(LAYOUT, sites=()), enlarged(), RIG)


@pytest.mark.parametrize("line", [np.zeros(3), np.array([0.0, 0.01, 0.002])])
def test_markers_on_one_line_or_in_one_place_are_refused(line: Array) -> None:
    with pytest.raises(InputError, match="not on one line"):
        performer_from_neutral(LAYOUT, np.outer(np.arange(len(LAYOUT.names)), line), RIG)


def test_millimetres_taken_for_metres_are_refused_with_a_word_on_units() -> None:
    with pytest.raises(InputError, match="must be in metres"):
        performer_from_neutral(LAYOUT, 1000 * enlarged(), RIG)


@pytest.mark.parametrize("sites", ["face24", "all"])
def test_left_and_right_swapped_are_refused(sites: str) -> None:
    layout = LAYOUT if sites == "face24" else face_layout("all", ALL_SITES)
    for seed in range(5):
        face = make_face(RIG, layout, np.random.default_rng(seed))
        with pytest.raises(InputError, match="mirror image"):
            performer_from_neutral(layout, face.performer.neutral * [-1, 1, 1], RIG)
