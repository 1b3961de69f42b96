"""The blink trick: shut at once, and open again from rest, or with the stale state that OpenVHead keeps."""

from __future__ import annotations

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.filters import BlinkTrick, PdGains, PdMass, SteppedPdMass
from tests.filters.test_pd_mass import OpenVHeadController

EYES = PdGains(mass=1, alpha=0.8)
THRESHOLD = 0.07
OPENNESS = np.concatenate(
    [np.full(30, 0.2), np.linspace(0.2, 0.0, 8), np.full(6, 0.0), np.linspace(0.0, 0.2, 8), np.full(60, 0.2)]
)


def test_with_the_stale_state_it_is_openvheads_blink() -> None:
    """Below the threshold the value is 0.01 and the controller is not called; v, e_1 and d_1 stay as they are."""
    controller = OpenVHeadController(0.2, M=1.0, ALPHA=0.8)
    ours = BlinkTrick(SteppedPdMass(EYES, np.full(1, 0.2)), THRESHOLD, after="stale")
    noisy = OPENNESS + np.random.default_rng(0).normal(scale=0.012, size=len(OPENNESS))
    for i, measure in enumerate(noisy):
        if measure < THRESHOLD:
            controller.X = 0.01
        else:
            controller.update(measure)
        assert ours(np.array([measure]), i / 60)[0] == pytest.approx(controller.X, abs=1e-9)


@pytest.mark.parametrize("smoother", [SteppedPdMass(EYES, np.full(1, 0.2)), PdMass(EYES)])
def test_at_rest_after_the_blink_the_eye_opens_as_from_the_floor(smoother: PdMass | SteppedPdMass) -> None:
    ours = BlinkTrick(smoother, THRESHOLD)
    path = np.array([ours(np.array([v]), i / 60)[0] for i, v in enumerate(OPENNESS)])
    shut = OPENNESS < THRESHOLD
    assert (path[shut] == 0.01).all()
    opened = int(np.flatnonzero(shut)[-1]) + 1
    fresh = SteppedPdMass(EYES, np.full(1, 0.01))
    from_the_floor = [fresh(np.array([v]), 0.0)[0] for v in OPENNESS[opened:]]
    np.testing.assert_allclose(path[opened:], from_the_floor, atol=1e-9)


def test_the_stale_state_opens_the_eye_later_than_rest_does() -> None:
    def opening(smoother: BlinkTrick) -> float:
        path = np.array([smoother(np.array([v]), i / 60)[0] for i, v in enumerate(OPENNESS)])
        return float(path[int(np.flatnonzero(OPENNESS < THRESHOLD)[-1]) + 4])

    stale = BlinkTrick(SteppedPdMass(EYES, np.full(1, 0.2)), THRESHOLD, after="stale")
    rest = BlinkTrick(SteppedPdMass(EYES, np.full(1, 0.2)), THRESHOLD)
    assert opening(stale) < opening(rest) - 0.005


def test_only_signals_below_their_own_threshold_are_forced() -> None:
    ours = BlinkTrick(PdMass(EYES), np.array([0.07, -np.inf]))
    ours(np.array([0.2, 0.2]), 0.0)
    smooth = ours(np.array([0.0, 0.0]), 1 / 60)
    assert smooth[0] == 0.01
    assert smooth[1] > 0.1


def test_an_eye_that_is_shut_in_the_first_frame_is_shut() -> None:
    ours = BlinkTrick(PdMass(EYES), 0.07)
    assert ours(np.zeros(1), 0.0)[0] == 0.01
    assert 0.01 < ours(np.full(1, 0.2), 1 / 60)[0] < 0.1


def test_a_stale_state_in_true_time_is_refused() -> None:
    with pytest.raises(InputError, match="stale"):
        BlinkTrick(PdMass(EYES), 0.07, after="stale")
