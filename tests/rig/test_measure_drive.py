"""From measures to weights: OpenVHead's two models to the last number, and ours beside them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.rig.load import load_rig
from retarget.rig.measure_drive import MeasureDrive
from retarget.rig.responses import BlinkPiecewise, MouthLength, MouthWidth, Response
from tests.filters.test_pd_mass import OpenVHeadController

if TYPE_CHECKING:
    from retarget.rig.measure_drive import MeasureSmoothing
    from retarget.rig.model import Rig

SHAPES = ("leftEye", "rightEye", "mouthWid", "mouthLen")


def model_2() -> Rig:
    responses = {
        "leftEye": Response("left_eye", BlinkPiecewise()),
        "rightEye": Response("right_eye", BlinkPiecewise()),
        "mouthWid": Response("mouth_width", MouthWidth()),
        "mouthLen": Response("mouth_length", MouthLength()),
    }
    return replace(load_rig("human"), shape_names=SHAPES, responses=responses)


def talking_and_blinking(seed: int, count: int = 400) -> list[dict[str, float]]:
    rng = np.random.default_rng(seed)
    t = np.arange(count) / 60
    eyes = 0.2 * (1 - np.maximum(0, np.sin(2.5 * t)) ** 20) + rng.normal(scale=0.012, size=(2, count))
    width = 0.1 + 0.1 * np.sin(22 * t) + rng.normal(scale=0.01, size=count)
    length = 0.35 + 0.12 * np.sin(9 * t) + rng.normal(scale=0.01, size=count)
    rows = zip(eyes[0].tolist(), eyes[1].tolist(), width.tolist(), length.tolist(), strict=True)
    return [dict(zip(("left_eye", "right_eye", "mouth_width", "mouth_length"), row, strict=True)) for row in rows]


@pytest.mark.parametrize(("smooth", "M", "threshold"), [("openvhead-1", 1.0, 0.07), ("openvhead-2", 2.0, 0.05)])
def test_openvheads_models_come_out_number_by_number(smooth: str, M: float, threshold: float) -> None:
    """Measure, blink trick, controller, curve: all straight from their description."""
    eyes = {name: OpenVHeadController(0.2, M=M, ALPHA=0.8) for name in ("left_eye", "right_eye")}
    mouth = {"mouth_width": OpenVHeadController(0.03), "mouth_length": OpenVHeadController(0.45)}
    last_length = 0.0
    ours = MeasureDrive(model_2(), cast("MeasureSmoothing", smooth))
    below_zero = 0
    for i, measures in enumerate(talking_and_blinking(0)):
        expected = []
        for name, controller in eyes.items():
            if measures[name] < threshold:
                controller.X = 0.01
            else:
                controller.update(measures[name])
            m = controller.X
            expected.append(100 if m < 0.05 else 5 / m if m < 0.1 else 100 - 500 * m if m < 0.2 else 0)
        width, length = (controller.update(measures[name]) for name, controller in mouth.items())
        expected.append(min(500 * width, 100))
        last_length = 50 if length < 0.1 else 120 - 400 * length if length < 0.4 else last_length
        expected.append(last_length)
        weights = 100 * ours(measures, i / 60)
        below_zero += int((weights < 0).any())
        np.testing.assert_allclose(weights, expected, atol=1e-7)
    assert below_zero > 0  # their weights do leave the range


@pytest.mark.parametrize("smooth", ["pd", "one-euro", "none"])
def test_ours_stay_in_range_and_shut_the_eye_in_a_blink(smooth: str) -> None:
    ours = MeasureDrive(model_2(), cast("MeasureSmoothing", smooth))
    rows = talking_and_blinking(1)
    weights = np.array([ours(m, i / 60) for i, m in enumerate(rows)])
    assert weights.min() >= 0
    assert weights.max() <= 1
    openness = np.array([m["left_eye"] for m in rows])
    assert weights[openness < 0.03, 0].mean() > 0.9
    still = (openness > 0.15) & (np.arange(len(rows)) > 30)
    assert weights[still, 0].mean() < 0.25


def test_a_face_that_is_lost_keeps_its_weights_and_reset_forgets_them() -> None:
    ours = MeasureDrive(model_2(), "one-euro")
    before = ours({"left_eye": 0.05, "mouth_width": 0.1}, 0.0)
    assert before[0] > 0.9
    np.testing.assert_array_equal(ours({"left_eye": math.nan}, 0.1), before)
    np.testing.assert_array_equal(ours({}, 0.2), before)
    ours.reset()
    assert not ours({}, 0.0).any()


def test_a_smoothing_that_there_is_not_is_refused() -> None:
    with pytest.raises(InputError, match="openvhead-2"):
        MeasureDrive(model_2(), cast("MeasureSmoothing", "soft"))
