"""Video2Anim's recorded runs come back, key by key."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.body2d import Rules, Settings, load_card, read_poses
from retarget.body2d.card import card_of_definitions
from retarget.body2d.convert import animate
from tests.body2d.oracle import needs_oracle, oracle, write_frames

if TYPE_CHECKING:
    from pathlib import Path

RUNS = 12


@pytest.fixture(scope="module")
def poses(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_frames(tmp_path_factory.mktemp("poses"), oracle()["frames"])


@needs_oracle
@pytest.mark.parametrize("number", range(RUNS))
def test_a_recorded_run_comes_back(poses: Path, number: int) -> None:
    assert len(oracle()["runs"]) == RUNS
    run = oracle()["runs"][number]
    settings = Settings(fps=oracle()["fps"], rules=Rules.VIDEO2ANIM, **run["settings"])
    clip = animate(read_poses(poses), settings, load_card("body25"), run["person"], "run").clip
    assert len(clip.bones) == len(run["keys"])
    for bone, keys in zip(clip.bones, run["keys"], strict=True):
        expected = np.array(keys)
        np.testing.assert_allclose(bone.curve.times_s, expected[:, 0], rtol=0, atol=1e-6)
        np.testing.assert_allclose(bone.curve.values[:, 2], expected[:, 1], rtol=0, atol=1e-6)
        np.testing.assert_allclose(bone.curve.in_slopes[:, 2], expected[:, 2], rtol=0, atol=1e-5)
        np.testing.assert_array_equal(bone.curve.in_slopes, bone.curve.out_slopes)
        assert not bone.curve.values[:, :2].any()


@needs_oracle
def test_the_card_is_its_example() -> None:
    card = load_card("body25")
    theirs = card_of_definitions("theirs", card.points, oracle()["bones"])
    assert [(b.start, b.end, b.parent, b.path) for b in card.bones] == [
        (b.start, b.end, b.parent, b.path) for b in theirs.bones
    ]
