"""Expressions found in a range of motion."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from calib.matching import Match, Motion, episodes, find_matches
from calib.rig_range import RigExtreme, RigRange
from tests.synthetic.motion import bump

if TYPE_CHECKING:
    from retarget.rig.model import Rig

LEVER_M = 0.1


@pytest.fixture(scope="module")
def extremes(human: Rig) -> list[RigExtreme]:
    return RigRange(human, tuple(human.sites)).extremes()


def performed(extremes: list[RigExtreme], order: list[str], strength: float = 1.0, scale: float = 0.8) -> Motion:
    """Each of `order` for a second, by a performer who is larger than the rig, with some noise and gaps."""
    times = np.arange(120 * 2 * len(order)) / 120
    by_name = {extreme.name: extreme for extreme in extremes}
    moves = np.zeros((len(times), *extremes[0].moves.shape))
    turn = np.zeros(len(times))
    for number, name in enumerate(order):
        level = strength * bump(times, 2.0 * number + 0.2, 0.4, 0.6, 0.4)
        moves += level[:, None, None] * by_name[name].moves / scale
        turn += level * by_name[name].jaw_rad
    rng = np.random.default_rng(0)
    moves += rng.normal(scale=2e-4, size=moves.shape)
    moves[rng.random(moves.shape[:2]) < 0.1] = np.nan
    return Motion(times, moves, moves, turn)


def found(human: Rig, extremes: list[RigExtreme], motion: Motion) -> dict[tuple[str, str], Match]:
    matches = find_matches(motion, extremes, tuple(human.sites), 0.8, LEVER_M)
    return {(match.name, match.side): match for match in matches}


def test_every_expression_is_found_when_it_was_made_and_nowhere_else(human: Rig, extremes: list[RigExtreme]) -> None:
    order = [extreme.name for extreme in extremes]
    matches = found(human, extremes, performed(extremes, order))
    for number, extreme in enumerate(extremes):
        match = matches[extreme.name, ""]
        assert match.exercised
        assert match.share == pytest.approx(1.0, abs=0.05)
        assert 2 * number < match.frames.min() / 120 < match.frames.max() / 120 < 2 * number + 2
        np.testing.assert_allclose(match.moves, extreme.moves / 0.8, atol=5e-4)


def test_what_was_not_made_is_not_found(human: Rig, extremes: list[RigExtreme]) -> None:
    matches = found(human, extremes, performed(extremes, ["smile", "browsUp"]))
    made = {name for (name, _), match in matches.items() if match.exercised}
    assert made == {"smile", "browsUp"}


def test_hardly_moving_is_not_making_an_expression(human: Rig, extremes: list[RigExtreme]) -> None:
    matches = found(human, extremes, performed(extremes, ["smile"], strength=0.15))
    assert not any(match.exercised for match in matches.values())


def test_one_brow_is_found_on_its_side_alone(human: Rig, extremes: list[RigExtreme]) -> None:
    right = [i for i, site in enumerate(human.sites) if not site.endswith("Left")]
    motion = performed(extremes, ["browsUp"])
    still = motion.moves.copy()
    still[:, right] = np.where(np.isnan(still[:, right]), np.nan, 0.0)
    matches = found(human, extremes, replace(motion, moves=still, whole=still))
    assert matches["browsUp", "Left"].exercised
    assert not matches["browsUp", "Right"].exercised


def test_only_frames_in_which_an_expression_was_asked_for_can_show_it(human: Rig, extremes: list[RigExtreme]) -> None:
    motion = performed(extremes, ["smile", "browsUp"])
    wrong = replace(motion, prompts=("nose",) * len(motion.times))
    right = replace(motion, prompts=("smile",) * 240 + ("browsUp",) * 240)
    assert not any(match.exercised for match in found(human, extremes, wrong).values())
    assert found(human, extremes, right)["smile", ""].exercised


def test_times_that_an_expression_was_made_are_told_apart(human: Rig, extremes: list[RigExtreme]) -> None:
    motion = performed(extremes, ["smile", "browsUp", "smile", "smile"])
    match = found(human, extremes, motion)["smile", ""]
    middles = [round(float(np.median(frames)) / 240, 1) for frames in episodes(match, motion.times)]
    assert middles == pytest.approx([0.45, 2.45, 3.45], abs=0.11)


def test_a_rig_that_tells_no_range_matches_nothing(human: Rig, extremes: list[RigExtreme]) -> None:
    assert find_matches(performed(extremes, ["smile"]), [], tuple(human.sites), 0.8, LEVER_M) == []
