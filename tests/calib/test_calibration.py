"""The whole way: a performer of whom everything is known is found again, and what was not done is told."""

from __future__ import annotations

import datetime
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from calib.calibration import Settings
from calib.findings import findings
from calib.fixed import by_direction
from calib.report import facts
from retarget import geometry
from retarget.errors import InputError
from retarget.performer import load_performer, performer_text, save_performer
from retarget.rig.joints import JointMapping
from tests.calib.truth import calibrated, recovered
from tests.synthetic.face import ALL_SITES, face_layout
from tests.synthetic.places import site_places
from tests.synthetic.rig import small_rig
from tests.synthetic.rom import neutral_take, person, range_of_motion, rough

if TYPE_CHECKING:
    from pathlib import Path

    from calib.calibration import Calibration
    from retarget.rig.model import Rig
    from tests.synthetic.face import SyntheticFace


@pytest.mark.parametrize("seed", [3, 13])
def test_K_hinge_and_angle_of_the_jaw_come_back_from_a_bad_day(human: Rig, seed: int) -> None:
    """Two of the performers; `python -m tests.benchmarks calib` prints twenty at 120 Hz."""
    result = recovered(human, face_layout("all", ALL_SITES), seed, rate_hz=60.0)
    rms = float(np.sqrt((result.noisy_angle_deg**2).mean()))
    print(
        f"seed {seed}: K off by {100 * np.abs(result.K).max():.1f} % at worst of {len(result.K)}, hinge axis by "
        f"{result.axis_deg:.2f} degrees, pivot by {1e3 * result.pivot_m:.2f} mm, angle by {rms:.2f} degrees RMS"
    )
    assert len(result.K) > 60
    assert np.quantile(np.abs(result.K), 0.98) < 0.05
    assert np.median(np.abs(result.K)) < 0.015
    assert result.axis_deg < 2
    assert result.pivot_m < 0.005
    assert rms < 0.5
    score = result.calibration.score
    assert score is not None
    assert score.calibrated < 0.2 * min(score.one, score.scale, score.warp)


def texts(calibration: Calibration) -> str:
    return " ".join(finding.text for finding in findings(calibration))


def test_what_was_never_done_is_said_side_by_side(found: tuple[SyntheticFace, Calibration]) -> None:
    said = texts(found[1])
    assert "The left corner of the mouth never smiled." in said
    assert "The lips never puckered." in said
    assert "The jaw never went to the right." in said
    assert "jaw never went to the left" not in said
    assert "brow" not in said


def test_the_calibrated_rig_ends_where_the_performer_means_it_to(found: tuple[SyntheticFace, Calibration]) -> None:
    """On a performance that the calibration has not seen, without noise: against the truth, in millimetres."""
    face, calibration = found
    rng = np.random.default_rng(99)
    talk = range_of_motion(face, rng, 30.0, ["smile", "browsUp", "browsDown", "nose"], rounds=1)
    errors = {}
    for name, performer in (("calibrated", calibration.performer), ("default", calibration.default)):
        mapping = JointMapping(face.rig, face.layout, performer)
        T = _laid(face, performer.neutral)
        off = []
        for i, frame in enumerate(talk.stabilised()):
            moved = replace(frame, positions=frame.positions @ T[:3, :3].T + T[:3, 3])
            places = site_places(face.rig, mapping(moved))
            off.append([np.linalg.norm(places[site] - talk.joints[site][i]) for site in mapping.sites])
        errors[name] = 1e3 * float(np.sqrt(np.mean(np.square(off))))
    print(f"RMS over all sites: {errors['calibrated']:.2f} mm calibrated, {errors['default']:.2f} mm by default")
    assert errors["calibrated"] < 0.5
    assert errors["calibrated"] < 0.4 * errors["default"]


def _laid(face: SyntheticFace, neutral: np.ndarray) -> np.ndarray:
    return geometry.kabsch(face.performer.neutral, neutral)


def test_the_performer_survives_its_file(found: tuple[SyntheticFace, Calibration], tmp_path: Path) -> None:
    performer = found[1].performer
    save_performer(performer, tmp_path / "ana.toml")
    loaded = load_performer(tmp_path / "ana.toml")
    assert performer_text(loaded) == (tmp_path / "ana.toml").read_text("utf-8")
    assert loaded.quality.keys() == performer.quality.keys()
    assert set(loaded.ranges) == set(ALL_SITES)
    for site, K in performer.K.items():
        np.testing.assert_allclose(loaded.K[site], K, rtol=1e-6)


def test_values_fixed_by_hand_are_kept(human: Rig, found: tuple[SyntheticFace, Calibration]) -> None:
    face, first = found
    K = dict(first.performer.K)
    K["lipUpper"] = 0.123 * np.eye(3)
    K["browMidLeft"] = 0.321 * np.eye(3)
    assert first.performer.jaw is not None
    jaw = replace(first.performer.jaw, gain=0.456, axis=np.array([1.0, 0.0, 0.0]))
    fixed = ("K.lipUpper", "K.browMidLeft.up", "jaw.gain", "jaw.axis", "scale")
    previous = replace(first.performer, K=K, jaw=jaw, fixed=fixed, scale=1.5)
    rng = np.random.default_rng(5)
    rom, rest = range_of_motion(face, rng, 60.0, rounds=1), neutral_take(face, rng, 60.0)
    again = calibrated(face, rest, rom, Settings(previous=previous))
    performer = again.performer
    assert performer.fixed == fixed
    assert performer.scale == 1.5
    np.testing.assert_array_equal(performer.K["lipUpper"], 0.123 * np.eye(3))
    up, down = by_direction(performer.K["browMidLeft"])[:, 1]
    assert up == 0.321
    assert down != 0.321
    assert performer.jaw is not None
    assert performer.jaw.gain == 0.456
    np.testing.assert_array_equal(performer.jaw.axis, [1.0, 0.0, 0.0])
    assert "Kept as set by hand: K.lipUpper, K.browMidLeft.up, jaw.gain" in texts(again)


def test_K_beyond_its_bounds_is_held_there_and_told(found: tuple[SyntheticFace, Calibration]) -> None:
    face, _ = found
    rng = np.random.default_rng(6)
    rom, rest = range_of_motion(face, rng, 60.0, ["smile", "jawOpen"], rounds=1), neutral_take(face, rng, 60.0)
    calibration = calibrated(face, rest, rom, Settings(bounds=(0.3, 0.5)))
    ratios = np.array([by_direction(K) for K in calibration.performer.K.values()]) / calibration.performer.scale
    assert 0.3 - 1e-3 < ratios.min() < ratios.max() < 0.5 + 1e-3
    assert "K is held at its bounds, 0.3 to 0.5 times the ratio of sizes" in texts(calibration)
    assert "The jaw's gain would be" in texts(calibration)


@pytest.mark.parametrize("bounds", [(1.0, 0.25), (0.0, 1.0), (0.5, 0.5)])
def test_bounds_that_cross_are_refused(bounds: tuple[float, float]) -> None:
    with pytest.raises(InputError, match="bounds of K cross"):
        Settings(bounds=bounds)


def test_the_same_takes_give_the_same_performer(human: Rig) -> None:
    rng = np.random.default_rng(8)
    face = person(human, face_layout(), rng)
    rest, rom = rough(neutral_take(face, rng, 60.0), rng), rough(range_of_motion(face, rng, 60.0, rounds=1), rng)
    settings = Settings(date=datetime.date(2026, 1, 2))
    first, second = (performer_text(calibrated(face, rest, rom, settings).performer) for _ in range(2))
    assert first == second


def test_a_rig_that_tells_no_range_leaves_K_alone_and_still_finds_the_jaw() -> None:
    """Joints without shapes: the neutral and the hinge are calibrated, K stays the ratio of sizes."""
    from tests.synthetic.capture import captured
    from tests.synthetic.motion import everything

    rng = np.random.default_rng(9)
    face = person(small_rig(), face_layout("all", ALL_SITES), rng)
    rom = captured(face, everything(face.rig, np.arange(1200) / 60, rng))
    calibration = calibrated(face, neutral_take(face, rng, 60.0), rom)
    for K in calibration.performer.K.values():
        np.testing.assert_allclose(K, calibration.performer.scale * np.eye(3), rtol=1e-3)
    assert calibration.jaw is not None
    assert calibration.jaw.hinge is not None
    assert "no shapes that tell its range" in texts(calibration)


def test_the_facts_are_plain_values_for_json(found: tuple[SyntheticFace, Calibration]) -> None:
    import json

    told = facts(found[1])
    assert json.loads(json.dumps(told)) == told
    assert [site["site"] for site in told["sites"]] == list(found[1].face.names)
    assert told["jaw"]["observed"]
