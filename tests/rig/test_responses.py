"""The curves at and around every breakpoint, against OpenVHead's formulas; what is clamped, and what is not."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.rig.load import load_rig
from retarget.rig.responses import (
    DEFAULTS,
    BlinkPiecewise,
    BlinkSigmoid,
    MouthLength,
    MouthWidth,
    Ramp,
    Response,
    Responses,
    Shocked,
    read_responses,
)
from retarget.toml_table import read_table

if TYPE_CHECKING:
    from pathlib import Path

    from retarget.rig.responses import Curve, Limits

NEAR = [0.0, 1e-12, -1e-12, 1e-4, -1e-4]
NAMES = ("eyeBlinkLeft", "eyeBlinkRight", "eyeWideLeft", "jawOpen", "mouthPucker")


def openvhead_piecewise(m: float) -> float:
    if m < 0.05:
        return 100
    if m < 0.1:
        return 5 / m
    if m < 0.2:
        return 100 - 500 * m
    return 0


def openvhead_sigmoid(m: float) -> float:
    return 100 - 100 / (1 + math.exp(-500 * (m - 0.12)))


def openvhead_shocked(m: float) -> float:
    return 500 * m - 125 if m > 0.25 else 0


def openvhead_mouth_width(m: float) -> float:
    return min(500 * m, 100)


def openvhead_mouth_length(m: float) -> float:
    if m < 0.1:
        return 50
    return 120 - 400 * m if m < 0.4 else math.nan


@pytest.mark.parametrize(
    ("ours", "theirs", "breaks"),
    [
        (BlinkPiecewise(), openvhead_piecewise, [0.0, 0.01, 0.049, 0.05, 0.0999, 0.1, 0.15, 0.2, 0.35]),
        (BlinkSigmoid(), openvhead_sigmoid, [0.0, 0.1, 0.119, 0.12, 0.121, 0.14, 0.5]),
        (Shocked(), openvhead_shocked, [0.0, 0.2, 0.25, 0.35, 0.6]),
        (MouthWidth(), openvhead_mouth_width, [-0.038, 0.0, 0.1, 0.2, 0.5]),
        (MouthLength(), openvhead_mouth_length, [0.0, 0.05, 0.1, 0.2, 0.3, 0.35, 0.4, 0.5]),
    ],
    ids=["piecewise", "sigmoid", "shocked", "width", "length"],
)
def test_a_curve_is_openvheads_over_100_at_and_around_every_breakpoint(
    ours: Curve, theirs: Curve, breaks: list[float]
) -> None:
    for at in breaks:
        for off in NEAR:
            assert 100 * ours(at + off) == pytest.approx(theirs(at + off), abs=1e-9, nan_ok=True)


def test_the_piecewise_blink_is_continuous_with_any_numbers() -> None:
    for blink in (BlinkPiecewise(), BlinkPiecewise(full=0.1, half=0.15, none=0.4)):
        measures = np.linspace(0.0, 0.5, 50001)
        weights = np.array([blink(m) for m in measures])
        assert np.abs(np.diff(weights)).max() < 3e-4
        assert weights[0] == 1
        assert weights[-1] == 0
        assert (np.diff(weights) <= 0).all()


def test_a_sigmoid_never_overflows() -> None:
    assert BlinkSigmoid()(-100.0) == pytest.approx(1.0)
    assert BlinkSigmoid()(100.0) == pytest.approx(0.0)


def test_a_ramp_goes_either_way() -> None:
    assert [Ramp(0.2, 0.6)(m) for m in (0.1, 0.3, 0.6, 0.9)] == pytest.approx([0, 0.25, 1, 1])
    assert [Ramp(0.6, 0.2)(m) for m in (0.1, 0.3, 0.6, 0.9)] == pytest.approx([1, 0.75, 0, 0])


@pytest.mark.parametrize(
    "make", [lambda: BlinkPiecewise(full=0.1), lambda: MouthLength(short=0.4), lambda: Ramp(0.5, 0.5)]
)
def test_numbers_that_make_no_curve_are_refused(make: type[Ramp]) -> None:
    with pytest.raises(InputError):
        make()


def responses(limits: Limits, **given: Response) -> Responses:
    return Responses(replace(load_rig("human"), shape_names=NAMES, responses=given), limits)


def test_weights_beyond_the_range_are_clamped_and_only_for_openvhead_are_not() -> None:
    """On purpose unlike OpenVHead, which sends -19 for a mouth that measures less than shut."""
    measures = {"mouth_width": -0.038, "right_eye": 0.6, "mouth_length": 0.35}
    given = {
        "jawOpen": Response("mouth_width", MouthWidth()),
        "eyeWideLeft": Response("right_eye", Shocked()),
        "mouthPucker": Response("mouth_length", MouthLength()),
    }
    ours, theirs = responses("clamped", **given)(measures), responses("openvhead", **given)(measures)
    np.testing.assert_allclose(theirs, [0, 0, 1.75, -0.19, -0.2])
    np.testing.assert_allclose(ours, [0, 0, 1, 0, 0])


def test_where_a_curve_says_nothing_or_a_measure_is_missing_the_last_weight_stays() -> None:
    solve = responses("clamped", mouthPucker=Response("mouth_length", MouthLength()))
    assert solve({"mouth_length": 0.2})[4] == pytest.approx(0.4)
    assert solve({"mouth_length": 0.45})[4] == pytest.approx(0.4)
    assert solve({"mouth_length": math.nan})[4] == pytest.approx(0.4)
    assert solve({})[4] == pytest.approx(0.4)
    solve.reset()
    assert solve({})[4] == 0


def test_a_rig_that_says_nothing_takes_the_defaults_for_the_shapes_it_has() -> None:
    solve = responses("clamped")
    assert solve.measures == ("right_eye", "left_eye", "mouth_width", "mouth_length")
    blink = solve({"left_eye": 0.0, "right_eye": 0.3, "mouth_width": 0.1, "mouth_length": 0.45})
    np.testing.assert_allclose(blink, [0, 1, 0.25, 0.5, 0])  # their left eye is on the left of the picture
    assert set(DEFAULTS) <= set(load_rig("human").shape_names)


def test_a_rig_without_any_shape_that_is_known_is_refused() -> None:
    with pytest.raises(InputError, match=r"\[responses\]"):
        Responses(replace(load_rig("human"), shape_names=("A", "I")))


def read(path: Path, text: str) -> dict[str, Response]:
    path.write_text(text)
    return read_responses(read_table(path, "rig file").table("responses"), NAMES)


def test_a_rig_file_chooses_and_tunes_curves(tmp_path: Path) -> None:
    text = """
        [responses]
        eyeBlinkLeft = { measure = "eye_left", curve = "blinkSigmoid", middle = 0.2 }
        jawOpen = { measure = "mouth_open", curve = "ramp", start = 0.02, end = 0.3 }
        """
    assert read(tmp_path / "rig.toml", text) == {
        "eyeBlinkLeft": Response("eye_left", BlinkSigmoid(middle=0.2)),
        "jawOpen": Response("mouth_open", Ramp(0.02, 0.3)),
    }


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('jawOpn = { measure = "x", curve = "ramp" }', "did you mean 'jawOpen'"),
        ('jawOpen = "ramp"', "must be a table"),
        ('jawOpen = { curve = "ramp" }', "'measure'.*missing"),
        ('jawOpen = { measure = "x", curve = "bezier" }', "must be one of blinkPiecewise"),
        ('jawOpen = { measure = "x", curve = "ramp", stop = 1 }', "unknown key 'stop'"),
        ('jawOpen = { measure = "x", curve = "ramp", start = "a" }', "must be a number"),
        ('jawOpen = { measure = "x", curve = "ramp", start = 1, end = 1 }', "'jawOpen'.*line 2.*a start and an end"),
    ],
)
def test_mistakes_in_a_rig_file_are_told_with_their_place(tmp_path: Path, line: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(tmp_path / "rig.toml", f"[responses]\n{line}\n")
