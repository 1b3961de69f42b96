"""Names of shapes and bones in all schemes, against lists copied from the schemes' own documents."""

from __future__ import annotations

import pytest

from retarget.rig.load import load_rig
from retarget.rig.names import (
    ARKIT,
    MEDIAPIPE,
    VISEMES,
    arkit_name,
    bone_roles,
    letters,
    nearest_arkit,
    pascal,
    site_name,
    vrm1_name,
)

LIVE_LINK_START = "EyeBlinkLeft EyeLookDownLeft EyeLookInLeft EyeLookOutLeft EyeLookUpLeft EyeSquintLeft EyeWideLeft"
OCULUS = "sil PP FF TH DD kk CH SS nn RR aa E I O U"


def test_the_52_are_those_of_the_default_rig() -> None:
    assert set(load_rig("human").shape_names) == set(ARKIT)
    assert len(ARKIT) == 52


def test_the_order_is_that_of_live_link_face() -> None:
    assert [pascal(name) for name in ARKIT[:7]] == LIVE_LINK_START.split()
    assert ARKIT.index("jawOpen") == 17
    assert ARKIT.index("browInnerUp") == 43
    assert ARKIT[51] == "tongueOut"


def test_mediapipes_order_is_alphabetical_with_neutral_first_and_without_the_tongue() -> None:
    assert len(MEDIAPIPE) == 52
    assert MEDIAPIPE[:3] == ("_neutral", "browDownLeft", "browDownRight")
    assert (MEDIAPIPE[9], MEDIAPIPE[25], MEDIAPIPE[51]) == ("eyeBlinkLeft", "jawOpen", "noseSneerRight")
    assert "tongueOut" not in MEDIAPIPE


@pytest.mark.parametrize("name", ARKIT)
def test_every_scheme_leads_back_to_arkits_name(name: str) -> None:
    for theirs in (name, pascal(name), letters(name), name.lower(), f"Head.{name}", f"blendShape1:{pascal(name)}"):
        assert arkit_name(theirs) == name


def test_directions_are_no_sides() -> None:
    assert letters("mouthLeft") == "mouthLeft"
    assert letters("mouthSmileLeft") == "mouthSmile_L"
    assert letters("eyeLookInRight") == "eyeLookIn_R"


def test_two_halves_of_one_shape_both_give_its_name() -> None:
    for theirs in ("browInnerUp_L", "browInnerUp_R"):
        assert arkit_name(theirs) == "browInnerUp"
    assert arkit_name("cheekPuff_L") == "cheekPuff"


@pytest.mark.parametrize("theirs", ["", "Smile", "viseme_aa", "Fcl_ALL_Joy", "eyeBlink", "jawOpenness", "L", "aa"])
def test_names_of_no_scheme_mean_nothing(theirs: str) -> None:
    assert arkit_name(theirs) is None


def test_visemes_and_presets_give_the_nearest_shape_or_none() -> None:
    for theirs in ("aa", "A", "viseme_aa"):
        assert nearest_arkit(theirs) == "jawOpen"
    assert nearest_arkit("viseme_O") == "mouthFunnel"
    assert nearest_arkit("Blink_L") == "eyeBlinkLeft"
    assert nearest_arkit("joy") is None
    assert nearest_arkit("") is None


def test_all_fifteen_visemes_are_in_the_table() -> None:
    assert {v.oculus for v in VISEMES if v.oculus} == {f"viseme_{v}" for v in OCULUS.split()}


def test_presets_of_vrm_0_have_their_names_of_vrm_1() -> None:
    old = ["Joy", "Angry", "Sorrow", "Fun", "A", "I", "U", "E", "O", "Blink_L", "Blink_R", "LookUp"]
    new = ["happy", "angry", "sad", "relaxed", "aa", "ih", "ou", "ee", "oh", "blinkLeft", "blinkRight", "lookUp"]
    assert [vrm1_name(name) for name in old] == new
    assert vrm1_name("BrowInnerUp") == "BrowInnerUp"


@pytest.mark.parametrize(
    "names",
    [
        ("head", "neck", "jaw", "leftEye", "rightEye"),
        ("mixamorig:Head", "mixamorig:Neck", "mixamorig:Jaw", "mixamorig:LeftEye", "mixamorig:RightEye"),
        ("head", "neck01", "jaw", "eye.L", "eye.R"),
        ("J_Bip_C_Head", "J_Bip_C_Neck", "J_Bip_C_Jaw", "J_Adj_L_FaceEye", "J_Adj_R_FaceEye"),
        ("CC_Base_Head", "CC_Base_Neck", "CC_Base_JawRoot", "CC_Base_L_Eye", "CC_Base_R_Eye"),
        ("Head", "Neck", "Jaw", "LeftEye", "RightEye"),
        ("DEF-head", "DEF-neck", "DEF-jaw", "DEF-eye.L", "DEF-eye.R"),
    ],
)
def test_bones_are_known_by_the_names_of_many_programs(names: tuple[str, ...]) -> None:
    others = ("Hips", "HeadTop_End", "mixamorig:HeadTop_End", "lefteye_end", "eyelid.L", "jawline")
    roles = dict(zip(("head", "neck", "jaw", "eye_left", "eye_right"), names, strict=True))
    assert bone_roles((*others, *names)) == roles


def test_nothing_is_taken_for_a_bone_that_it_is_not() -> None:
    assert bone_roles(("Hips", "HeadTop_End", "eyelid.L", "armature")) == {}


def test_joints_named_after_sites_are_found() -> None:
    sites = load_rig("human").sites
    assert site_name("lip_corner.L", sites) == "lipCornerLeft"
    assert site_name("DEF-noseTip", sites) == "noseTip"
    assert site_name("lip", sites) is None
