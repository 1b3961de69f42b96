"""The head taken out of a recording, and head markers that cannot be told apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from calib.stabilised import exchangeable, stabilised
from retarget.errors import InputError
from tests.calib.truth import recording
from tests.synthetic.face import HEAD_BAND, face_layout
from tests.synthetic.rom import person, range_of_motion, rough

if TYPE_CHECKING:
    from calib.recording import Recording
    from retarget.rig.model import Rig
    from tests.synthetic.face import SyntheticFace


@pytest.fixture(scope="module")
def take(human: Rig) -> tuple[SyntheticFace, Recording, np.ndarray]:
    """A performer, a rough take, and where the markers truly were in the head."""
    rng = np.random.default_rng(8)
    face = person(human, face_layout(), rng)
    clean = range_of_motion(face, rng, only=["smile", "browsUp"], rounds=1)
    truth = np.array([frame.positions for frame in clean.stabilised()])
    return face, recording("rom", rough(clean, rng)), truth


def test_a_swaying_head_is_taken_out_within_the_noise(take: tuple[SyntheticFace, Recording, np.ndarray]) -> None:
    face, rough_take, truth = take
    result = stabilised(rough_take, face.performer.head_template)
    off = np.linalg.norm(result.positions - truth, axis=2)
    print(f"off by {1e3 * np.nanmedian(off):.2f} mm, 99 % within {1e3 * np.nanquantile(off, 0.99):.2f} mm")
    assert np.nanmedian(off) < 0.0007
    assert np.nanquantile(off, 0.99) < 0.003
    assert 0.3e-3 < result.residual_m < 0.8e-3
    assert result.missing.mean() == pytest.approx(0.1, abs=0.02)
    assert result.spikes.mean() == pytest.approx(0.045, abs=0.015)


def test_head_markers_that_are_missing_most_of_the_time_are_named(
    take: tuple[SyntheticFace, Recording, np.ndarray],
) -> None:
    face, rough_take, _ = take
    world = rough_take.world.copy()
    world[: 2 * len(world) // 3, :2] = np.nan
    blind = recording("rom", _Blind(rough_take.layout, rough_take.times, world))  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"Head markers are missing in rom: three .*headBackRight.* [0-9]+ %"):
        stabilised(blind, face.performer.head_template)


class _Blind:
    def __init__(self, layout: object, times: np.ndarray, p_world: np.ndarray) -> None:
        self.layout, self.times, self.p_world = layout, times, p_world


def test_a_square_of_head_markers_is_told_to_be_exchangeable_and_an_asymmetric_band_is_not() -> None:
    square = np.array([[0.07, 0.17, 0.07], [-0.07, 0.17, 0.07], [0.07, 0.17, -0.07], [-0.07, 0.17, -0.07]])
    same = exchangeable(square, tuple(HEAD_BAND))
    assert same is not None
    assert same[1] < 1e-9
    spread = square + np.array([[0.0, 0.0, 0.02], [0.0, 0.03, 0.0], [0.01, -0.02, 0.0], [0.0, 0.0, 0.0]])
    assert exchangeable(spread, tuple(HEAD_BAND)) is None


def test_two_of_many_head_markers_that_mirror_each_other_are_told() -> None:
    line = np.array([[0.0, 0.01 * i, 0.003 * i * i] for i in range(6)])
    twins = np.vstack([line, [[0.0005, 0.03, 0.2], [-0.0005, 0.03, 0.2]]])
    same = exchangeable(twins, tuple("abcdefgh"))
    assert same is not None
    assert same[0] == ("g", "h")
