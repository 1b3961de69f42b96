"""Real recordings of one performer: the jaw and the eyebrows, each from its first frames on.

AnimFace by Miguel Ramos Carretero, CC BY-SA 4.0; the recordings stay outside the project.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.calibration import Calibration, Settings, calibrate
from calib.findings import findings
from calib.performer_command import read_material
from calib.pictures import pictures
from calib.rig_range import chin_group
from retarget.rig.load import load_rig

DATA = Path(__file__).parents[2] / "../shared/data/animface"
JAW, EYEBROWS = str(DATA / "jaw.c3d"), str(DATA / "eyebrows.c3d")
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the AnimFace takes are not here")


def from_takes(*takes: str) -> Calibration:
    material = read_material(takes, takes, None, None)
    return calibrate(material, material.takes[0].recording.layout, load_rig("human"), Settings())


@pytest.fixture(scope="module")
def both() -> Calibration:
    return from_takes(JAW, EYEBROWS)


@pytest.fixture(scope="module")
def brows() -> Calibration:
    return from_takes(EYEBROWS)


def texts(calibration: Calibration) -> list[str]:
    return [finding.text for finding in findings(calibration)]


def made(calibration: Calibration) -> set[str]:
    return {match.name for match in calibration.matches if match.exercised}


def test_the_motions_of_both_takes_names_are_found_and_no_smile(both: Calibration) -> None:
    assert {"jawOpen", "jawLeft", "jawRight", "jawForward", "browsUp", "browsDown"} <= made(both)
    assert not {"smile", "pucker", "cheeks"} & made(both)
    assert "The lips never puckered." in texts(both)


def test_the_jaw_opens_about_a_hinge_near_the_ears(both: Calibration) -> None:
    """Ears are not marked; the hinge of the rig, at the performer's size, is the joint before them."""
    jaw, default = both.performer.jaw, both.default.jaw
    assert jaw is not None
    assert default is not None
    assert both.jaw is not None
    assert both.jaw.hinge is not None
    away = np.linalg.norm((jaw.pivot - default.pivot)[1:])
    print(f"hinge {1e3 * away:.0f} mm off the rig's, opening {np.degrees(both.jaw.opening_rad):.1f} degrees")
    assert away < 0.02
    assert abs(jaw.axis[0]) > 0.98
    assert 12 < np.degrees(both.jaw.opening_rad) < 30
    assert 0.5 < jaw.gain <= 1


def test_slides_of_the_jaw_are_told_apart_from_its_opening(both: Calibration) -> None:
    assert both.jaw is not None
    seen = both.jaw.slides
    assert 0.005 < seen.forward_m < 0.02
    assert 0.004 < seen.left_m < 0.015
    assert 0.003 < seen.right_m < 0.015
    slides = [m for m in both.matches if m.name in ("jawLeft", "jawRight", "jawForward")]
    assert all(np.degrees(abs(m.turn_rad)) < 3 for m in slides)


def test_the_forehead_hardly_moves_with_the_jaw_and_brows_go_up_and_down(both: Calibration) -> None:
    jaw_frames = both.laid.times < 26
    head = [both.face.names.index(s) for s in ("foreheadLeft", "foreheadRight")]
    swing = np.nanquantile(np.abs(both.motion.moves[jaw_frames][:, head]), 0.99)
    brow = both.seen[:, both.face.names.index("browMidLeft"), 1]
    print(
        f"forehead {1e3 * swing:.1f} mm in the jaw take; left brow from {1e3 * brow[1]:.1f} to {1e3 * brow[0]:.1f} mm"
    )
    assert swing < 0.001
    assert brow[0] > 0.005
    assert brow[1] < -0.005


def test_without_the_jaw_the_report_says_so_and_keeps_the_default(brows: Calibration) -> None:
    assert any("the jaw was never exercised" in text and "rig's hinge is kept" in text for text in texts(brows))
    assert brows.performer.jaw is not None
    assert brows.default.jaw is not None
    assert brows.performer.jaw.gain == brows.default.jaw.gain == 1.0
    moved = brows.turn.points(brows.default.jaw.pivot)
    np.testing.assert_allclose(brows.performer.jaw.pivot, moved)
    assert not {"jawOpen", "jawLeft", "jawRight", "jawForward"} & made(brows)
    chin = brows.face.names[chin_group(brows.face.names)[0]]
    np.testing.assert_allclose(brows.performer.K[chin], brows.performer.scale * np.eye(3), rtol=1e-3)


def test_what_was_held_out_is_predicted_better_than_by_simpler_ways(brows: Calibration) -> None:
    score = brows.score
    assert score is not None
    print(f"held out: {score.calibrated:.2f} mm; K=1 {score.one:.2f}, size {score.scale:.2f}, warp {score.warp:.2f}")
    assert score.calibrated < 0.7 * min(score.one, score.scale, score.warp)


def test_the_extremes_are_drawn_before_and_after(both: Calibration) -> None:
    drawn, why_not = pictures(both)
    if why_not:
        pytest.skip(why_not)
    assert {extreme.name.split(",")[0] for extreme in drawn} == made(both)
    assert all(len(extreme.before) > 5000 and extreme.before != extreme.after for extreme in drawn)
