"""The still face: found, averaged, and refused."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from calib.neutral import _spreads, find_neutral, geometric_median
from retarget import geometry
from retarget.errors import InputError
from tests.calib.truth import recording
from tests.synthetic.face import face_layout
from tests.synthetic.rom import neutral_take, person, range_of_motion, rough

if TYPE_CHECKING:
    from calib.recording import Recording
    from retarget.rig.model import Rig
    from tests.synthetic.face import SyntheticFace


@pytest.fixture(scope="module")
def somebody(human: Rig) -> SyntheticFace:
    return person(human, face_layout(), np.random.default_rng(2))


def resting(face: SyntheticFace, seed: int = 0, seconds: float = 3.0) -> Recording:
    rng = np.random.default_rng(seed)
    return recording("neutral", rough(neutral_take(face, rng, seconds=seconds), rng))


@pytest.mark.parametrize("seed", range(3))
def test_out_of_noise_gaps_and_outliers_comes_the_face_within_a_tenth_of_a_millimetre(
    somebody: SyntheticFace, seed: int
) -> None:
    still = find_neutral(resting(somebody, seed))
    T = geometry.kabsch(somebody.performer.neutral, still.positions)
    off = np.linalg.norm(geometry.apply(T, somebody.performer.neutral) - still.positions, axis=1)
    print(f"seed {seed}: neutral off by {1e3 * off.mean():.3f} mm on average, {1e3 * off.max():.3f} mm at worst")
    assert off.mean() < 1e-4
    assert off.max() < 2.5e-4
    assert still.end_s - still.start_s > 0.45
    assert 0.0003 < np.median(still.noise) < 0.0008  # 0.3 mm along each axis is 0.52 mm in space, and the head's jitter


def test_the_still_stretch_is_found_among_motion(somebody: SyntheticFace) -> None:
    rng = np.random.default_rng(4)
    rom, rest = range_of_motion(somebody, rng, only=["smile"]), neutral_take(somebody, rng, seconds=1.2)
    world = np.concatenate([rom.p_world[40:160], rest.p_world, rom.p_world[40:160]])
    take = replace(resting(somebody), times=np.arange(len(world)) / 120, world=world)
    still = find_neutral(take)
    assert still.start_s > 0.9
    assert still.end_s < 2.3


def test_only_the_beginning_is_searched_where_that_is_asked_for(somebody: SyntheticFace) -> None:
    assert find_neutral(resting(somebody, seconds=6.0), 2.0).end_s <= 2.0


def test_a_face_that_never_rests_is_refused_with_how_much_it_strays(somebody: SyntheticFace) -> None:
    rng = np.random.default_rng(1)
    take = resting(somebody)
    shaken = replace(take, world=take.world + rng.normal(scale=0.004, size=take.world.shape))
    with pytest.raises(InputError, match=r"no still stretch: even in the 0\.5 s from .* stray .* mm .* rests"):
        find_neutral(shaken)


def test_a_take_without_half_a_second_is_refused(somebody: SyntheticFace) -> None:
    with pytest.raises(InputError, match="too short for a neutral"):
        find_neutral(resting(somebody, seconds=0.3))


def test_without_head_markers_there_is_no_neutral(somebody: SyntheticFace) -> None:
    take = resting(somebody)
    take.world[:, [0, 1]] = np.nan
    with pytest.raises(InputError, match=r"Head markers are missing in neutral.*headFrontLeft"):
        find_neutral(take)


def test_the_geometric_median_does_not_follow_outliers_and_knows_what_was_never_seen() -> None:
    points = np.zeros((11, 2, 3))
    points[:4, 0] = [0.05, 0.0, 0.0]
    points[:, 1] = np.nan
    centre = geometric_median(points)
    np.testing.assert_allclose(centre[0], 0.0, atol=1e-4)
    assert np.isnan(centre[1]).all()


@pytest.mark.parametrize("frames", [239, 240, 241])
def test_a_recording_just_as_long_as_the_stretch_has_one(frames: int) -> None:
    laid = np.random.default_rng(1).normal(scale=1e-4, size=(frames, 5, 3))
    assert len(_spreads(laid, frames)) >= 1
