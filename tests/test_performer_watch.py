"""A performer file edited during a run: the next frame uses it, or it is refused and the old one stays."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget import performer_watch
from retarget.markers.layouts import load_layout
from retarget.performer import load_performer, save_performer
from retarget.performer_watch import PerformerWatch
from retarget.session import Session
from tests.synthetic.capture import captured
from tests.synthetic.face import face_layout, make_face
from tests.synthetic.motion import everything
from tests.synthetic.rig import small_rig

if TYPE_CHECKING:
    from pathlib import Path

    from retarget.frames import MarkerFrame, Pose
    from retarget.rig.model import Rig

SITE = "browMidLeft"
GAIN = rf"(?s)(\[K\].*?\n{SITE} = )[^\n]*"


class Running:
    """A session on a saved performer, with frames to feed."""

    def __init__(self, path: Path) -> None:
        rng = np.random.default_rng(3)
        self.rig: Rig = small_rig()
        face = make_face(self.rig, face_layout(), rng)
        save_performer(face.performer, path)
        self.path = path
        self.frames: list[MarkerFrame] = list(captured(face, everything(self.rig, np.arange(60) / 120, rng)).frames())
        updates = PerformerWatch(path)
        self.session = Session(self.rig, load_performer(path), load_layout("face24"), updates=updates)

    def edit(self, pattern: str, replacement: str) -> None:
        self.path.write_text(re.sub(pattern, replacement, self.path.read_text()))

    def moved(self, frame: MarkerFrame) -> np.ndarray:
        (pose,) = self.session(frame)
        return self.of(pose)

    def of(self, pose: Pose) -> np.ndarray:
        joint = self.rig.sites[SITE].joint
        moved: np.ndarray = pose.translations[joint] - self.rig.joints.translations[joint]
        return moved


@pytest.fixture
def running(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Running:
    monkeypatch.setattr(performer_watch, "LOOK_EVERY_S", 0.0)
    return Running(tmp_path / "ana.toml")


def test_an_edited_gain_moves_the_next_frame(running: Running) -> None:
    before = running.moved(running.frames[20])
    running.edit(GAIN, r"\g<1>0.001")
    after = running.moved(running.frames[20])
    assert np.linalg.norm(after) < 0.01 * np.linalg.norm(before)


def test_an_edited_neutral_starts_from_the_new_face(running: Running) -> None:
    before = running.moved(running.frames[20])
    running.edit(r"(?s)(\[neutral\].*?browMidLeft = \[)[-0-9.]+", r"\g<1>0.5")
    assert np.abs(running.moved(running.frames[20]) - before).max() > 0.1


@pytest.mark.parametrize(
    ("pattern", "replacement", "words"),
    [
        (r"scale =", "skale =", "skale"),
        (r"(?m)^\[K\].*$", "[K]\nnowhere = 0.5", "nowhere"),
        (r"(?s)^.*$", "", "stays as it was"),
    ],
)
def test_an_edit_that_cannot_be_used_is_told_and_the_old_one_stays(
    running: Running, caplog: pytest.LogCaptureFixture, pattern: str, replacement: str, words: str
) -> None:
    before = running.moved(running.frames[20])
    running.edit(pattern, replacement)
    np.testing.assert_array_equal(running.moved(running.frames[20]), before)
    assert words in caplog.text
    told = len(caplog.records)
    running.moved(running.frames[21])
    assert len(caplog.records) == told


def test_no_frame_is_lost_while_the_file_changes(running: Running) -> None:
    for i, frame in enumerate(running.frames):
        running.edit(GAIN, rf"\g<1>{0.5 + i / 100}")
        assert len(running.session(frame)) == 1


def test_a_file_that_is_replaced_bit_by_bit_by_an_editor_is_waited_for(running: Running) -> None:
    before = running.moved(running.frames[20])
    text = running.path.read_text()
    running.path.unlink()
    np.testing.assert_array_equal(running.moved(running.frames[20]), before)
    running.path.write_text(re.sub(GAIN, r"\g<1>0.001", text))
    assert np.linalg.norm(running.moved(running.frames[20])) < 0.01 * np.linalg.norm(before)
