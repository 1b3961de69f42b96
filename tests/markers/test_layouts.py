"""Layouts: the packaged cards against the recordings and the face, and what a user may write."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.markers import available_layouts, detect_layout, load_layout, read_c3d
from tests.markers.takes import HEADBAND, JAW, recording

if TYPE_CHECKING:
    from pathlib import Path

FACE = """
    forehead foreheadLeft foreheadRight browInnerLeft browInnerRight browMidLeft browMidRight browOuterLeft
    browOuterRight browCenter noseBridge noseTip noseWingLeft noseWingRight lidUpperLeft lidUpperRight lidLowerLeft
    lidLowerRight eyeInnerLeft eyeInnerRight eyeOuterLeft eyeOuterRight cheekUpperLeft cheekUpperRight cheekLowerLeft
    cheekLowerRight cheekOuterLeft cheekOuterRight lipUpper lipUpperLeft lipUpperRight lipCornerLeft lipCornerRight
    lipLower lipLowerLeft lipLowerRight chin chinLeft chinRight mandibleLeft mandibleRight
"""
SITES = FACE.split()
CARD = """
version = 1
name = "mine"
[markers]
brow = { site = "browCenter", aliases = ["BRW"] }
LFHD = { head = true }
RFHD = { head = true }
LBHD = { head = true }
"""


def card(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def test_the_packaged_layouts_are_two_of_markers_and_two_of_landmarks() -> None:
    assert available_layouts() == ("animface41", "face24", "ibug68", "mediapipe478")


def test_animface41_gives_every_site_once() -> None:
    assert sorted(load_layout("animface41").markers.sites) == sorted(SITES)


def test_the_face_mesh_gives_every_site_once_and_the_68_landmarks_most() -> None:
    mesh, few = load_layout("mediapipe478").markers, load_layout("ibug68").markers
    assert (len(mesh.names), len(few.names)) == (478, 68)
    assert sorted(site for site in mesh.sites if site) == sorted(SITES)
    unseen = {site for site in SITES if site.startswith(("forehead", "cheek", "browCenter"))}
    assert set(SITES) - set(few.sites) == unseen


def test_face24_is_20_sites_and_a_head_band_of_4() -> None:
    markers = load_layout("face24").markers
    sites = [site for site in markers.sites if site]
    assert len(sites) == 20
    assert set(sites) < set(SITES)
    assert [markers.names[i] for i in markers.head] == [n for n in markers.names if n.startswith("head")]
    assert len(markers.head) == 4
    assert all(not markers.sites[i] for i in markers.head)


def test_the_names_of_the_real_take_are_all_known_and_lie_on_their_sides() -> None:
    clip = read_c3d(recording(JAW))
    layout = detect_layout(clip.layout.names)
    assert layout.name == "animface41"
    match = layout.match(clip.layout.names)
    assert sorted(match.at) == list(range(41))
    assert match.unmatched == ()
    places = dict(zip(layout.markers.sites, clip.positions[0, list(match.at)], strict=True))
    for site in SITES:
        if site.endswith("Left"):
            assert places[site][0] > places[site.removesuffix("Left") + "Right"][0], site  # +X is the performer's left
    assert places["forehead"][1] > places["noseBridge"][1] > places["noseTip"][1] > places["lipUpper"][1]
    assert places["lipUpper"][1] > places["lipLower"][1] > places["chin"][1]


def test_face24_finds_its_face_among_the_names_of_the_real_take_too() -> None:
    names = read_c3d(recording(JAW)).layout.names
    mine, theirs = load_layout("face24"), load_layout("animface41")
    at, other = mine.match(names).at, theirs.match(names).at
    for marker, site in enumerate(mine.markers.sites):
        assert not site or at[marker] == other[theirs.markers.sites.index(site)], site


def test_the_head_band_of_a_real_take_is_found_by_its_aliases() -> None:
    clip = read_c3d(recording(HEADBAND))
    layout = load_layout("face24")
    at = layout.match(clip.layout.names).at
    assert [clip.layout.names[at[i]] for i in layout.markers.head] == ["LFHD", "RFHD", "LBHD", "RBHD"]


def test_the_typical_face_agrees_with_the_real_one_in_size_and_shape() -> None:
    from retarget.geometry import apply, umeyama

    clip = read_c3d(recording(JAW))
    layout = load_layout("face24")
    at = np.array(layout.match(clip.layout.names).at)
    assert layout.markers.rest is not None
    rest, real = layout.markers.rest[at >= 0], clip.positions[0, at[at >= 0]]
    T, scale = umeyama(rest, real)
    assert 0.8 < scale < 1.4
    assert np.linalg.norm(apply(T, scale * rest) - real, axis=1).max() < 0.015


def test_case_separators_and_subjects_make_no_difference() -> None:
    layout = load_layout("face24")
    at = layout.match(["x", "Ana:CHIN", "ana:lip_upper", "Ana:Lip Corner-Left", "Ana:lfhd"]).at
    found = {name: i for name, i in zip(layout.markers.names, at, strict=True) if i >= 0}
    assert found == {"chin": 1, "lipUpper": 2, "lipCornerLeft": 3, "headFrontLeft": 4}


def test_of_two_people_the_one_with_more_known_markers_is_followed() -> None:
    layout = load_layout("face24")
    match = layout.match(["Bob:chin", "Ana:chin", "Ana:lipUpper", "Bob:other"])
    assert match.at[layout.markers.names.index("chin")] == 1
    assert match.unmatched == (0, 3)


def test_a_markers_own_name_goes_before_an_alias() -> None:
    layout = load_layout("face24")
    assert layout.match(["LFHD", "headFrontLeft"]).at[layout.markers.names.index("headFrontLeft")] == 1


def test_detection_without_a_fit_names_what_was_seen_and_what_was_expected() -> None:
    with pytest.raises(InputError) as caught:
        detect_layout(["Marker1", "LFHD"])
    sentence = str(caught.value)
    assert "Seen: Marker1, LFHD." in sentence
    for layout in available_layouts():
        assert layout in sentence
    assert "browInnerLeft" in sentence
    assert "ForeHead_M" in sentence


def test_detection_of_nothing_says_so() -> None:
    with pytest.raises(InputError, match="Seen: no names at all"):
        detect_layout([])


def test_a_tie_is_not_decided_by_chance() -> None:
    with pytest.raises(InputError, match="animface41 and face24 fit"):
        detect_layout(["chin"])


def test_a_users_card_is_read_from_its_path(tmp_path: Path) -> None:
    layout = load_layout(card(tmp_path, CARD))
    assert layout.markers.names == ("brow", "LFHD", "RFHD", "LBHD")
    assert layout.markers.sites == ("browCenter", "", "", "")
    assert layout.markers.head == (1, 2, 3)
    assert layout.markers.rest is None
    assert layout.match(["brw"]).at == (0, -1, -1, -1)


def test_a_card_may_give_the_rest_of_some_markers(tmp_path: Path) -> None:
    text = CARD.replace('site = "browCenter"', 'site = "browCenter", rest = [0, 0.1, 0.1]')
    rest = load_layout(card(tmp_path, text)).markers.rest
    np.testing.assert_array_equal(rest, [[0, 0.1, 0.1], *[[np.nan] * 3] * 3])


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("version = 1", "", "version"),
        ("version = 1", "version = 2", "version"),
        ("aliases", "alias", "'alias'.*did you mean 'aliases'"),
        ("[markers]", "[marker]", "'marker'.*did you mean 'markers'"),
        ('"browCenter"', "3", "'site'"),
        ("head = true", "head = 1", "'head'"),
        ('["BRW"]', '"BRW"', "'aliases'"),
        ('["BRW"]', '["LFHD"]', "'brow' and 'LFHD' both answer to"),
        ('["BRW"]', '["-"]', "is no name"),
        ("LFHD = { head = true }", "", "at least 3"),
        ("LFHD = { head", 'LFHD = { site = "browCenter", head', "2 markers drive the site 'browCenter'"),
        ('aliases = ["BRW"]', "rest = [1, 2]", "'rest'"),
        ("name =", "name", "is not a TOML text"),
    ],
)
def test_a_mistake_in_a_card_is_refused_with_its_place(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    assert old in CARD
    path = card(tmp_path, CARD.replace(old, new))
    with pytest.raises(InputError, match=sentence) as caught:
        load_layout(path)
    assert str(path) in str(caught.value)


def test_an_unknown_layout_lists_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="give one of animface41, face24"):
        load_layout("face25")
    with pytest.raises(InputError, match="cannot be read"):
        load_layout(tmp_path / "absent.toml")
