"""A clip as marker frames, through the whole face; and a face that goes and comes back."""

from __future__ import annotations

import itertools
import logging
from functools import cache
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest

from retarget.camera.files import FilmPictures
from retarget.camera.landmarks import MESH478, Landmarks
from retarget.camera.source import CameraSource, make_detector
from retarget.errors import InputError
from retarget.markers.layouts import detect_layout
from retarget.rig.load import load_rig
from retarget.session import Session, poses
from tests.camera import clips

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame, MarkerLayout

MODELS = ("face_detector", "face_mesh478", "face_geometry")


@cache
def clip_frames() -> list[MarkerFrame]:
    """All frames of the clip, with the default detector."""
    return read_clip()


def read_clip() -> list[MarkerFrame]:
    clips.need(*MODELS)
    with CameraSource(str(clips.carphone())) as source:
        frames = list(source)
        assert source.counts() == {"received": 120, "without a face": 0, "dropped": 0}
    return frames


def test_every_picture_of_the_clip_has_a_face_half_a_metre_before_the_camera() -> None:
    frames = clip_frames()
    places = np.array([frame.positions for frame in frames])
    assert np.isfinite(places).all()
    assert [frame.time_s for frame in frames] == pytest.approx(np.arange(120) / 29.97, abs=1e-3)
    nose, left, right, chin, brow = (places[:, i] for i in (1, 263, 33, 152, 10))
    assert ((nose[:, 2] > -0.8) & (nose[:, 2] < -0.3)).all()
    assert (left[:, 0] > right[:, 0]).all()
    assert (brow[:, 1] > chin[:, 1]).all()
    assert (nose[:, 2] > (left + right)[:, 2] / 2).all()
    assert np.linalg.norm(left - right, axis=1) == pytest.approx(0.089, abs=0.006)


def test_the_face_follows_the_clip() -> None:
    """The man opens his mouth wide at picture 60, and his eyes are shut at some."""
    frames = clip_frames()
    assert detect_layout(frames[0].layout.names).name == "mediapipe478"
    rig = load_rig("human")
    solved = list(poses(frames, Session(rig)))
    assert len(solved) == 120
    jaw = rig.joints.names.index("jaw")
    openings = np.array([2 * np.arctan2(pose.rotations[jaw, 0], pose.rotations[jaw, 3]) for pose in solved])
    gaps = np.array([np.linalg.norm(frame.positions[13] - frame.positions[14]) for frame in frames])
    assert np.corrcoef(openings, gaps)[0, 1] > 0.8
    lids = [rig.joints.names.index(name) for name in ("lidUpperLeft", "lidLowerLeft")]
    shown = np.array([np.subtract(*pose.translations[lids, 1]) for pose in solved])
    seen = np.array([frame.positions[386, 1] - frame.positions[374, 1] for frame in frames])
    assert np.corrcoef(shown, seen)[0, 1] > 0.8


def test_the_68_landmarks_read_off_the_mesh_open_the_mouth_as_well() -> None:
    clips.need(*MODELS)
    with CameraSource(str(clips.carphone()), "mediapipe68") as source:
        frames = list(source)
    assert detect_layout(frames[0].layout.names).name == "ibug68"
    assert all(np.isfinite(frame.positions).all() for frame in frames)
    jaw = load_rig("human").joints.names.index("jaw")
    few, many = (
        np.array([pose.rotations[jaw, 0] for pose in poses(each, Session(load_rig("human")))])
        for each in (frames, clip_frames())
    )
    assert np.corrcoef(few, many)[0, 1] > 0.8


class Blinking:
    """A detector that sees a face in some pictures only."""

    layout: MarkerLayout = MESH478

    def __init__(self, points: NDArray[np.float64], seen: list[bool]) -> None:
        self._points = points
        self._seen = iter(seen)

    def reset(self) -> None:
        pass

    def __call__(self, picture: NDArray[np.uint8]) -> Landmarks | None:  # noqa: ARG002 - it does not look
        return Landmarks(MESH478, self._points, 0.9) if next(self._seen) else None


def folder(path: Path, count: int) -> str:
    for i in range(count):
        cv2.imwrite(str(path / f"{i}.png"), np.zeros((144, 176, 3), np.uint8))
    return str(path)


def test_a_face_that_goes_and_comes_back_is_said_once_and_is_nan_meanwhile(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    clips.need("face_geometry")
    points = np.random.default_rng(0).uniform(40, 100, (478, 3))
    seen = [True] * 3 + [False] * 4 + [True] * 2 + [False]
    with CameraSource(folder(tmp_path, 10), Blinking(points, seen)) as source, caplog.at_level(logging.WARNING):
        confidence, frames = [], []
        for frame in source:
            frames.append(frame)
            confidence.append(source.confidence)
    assert [bool(np.isfinite(frame.positions).all()) for frame in frames] == seen
    assert confidence == [0.9 if each else 0.0 for each in seen]
    assert [record.message[:17] for record in caplog.records] == [
        "No face in the pi", "A face is in the ", "No face in the pi",
    ]  # fmt: skip
    assert source.counts()["without a face"] == 5


def test_the_pose_eases_to_neutral_while_the_face_is_lost() -> None:
    frames = clip_frames()
    hidden = [
        frame if i < 70 else type(frame)(i, frame.time_s, frame.received_s, frame.layout, frame.positions * np.nan)
        for i, frame in enumerate(frames)
    ]
    rig = load_rig("human")
    solved = list(poses(hidden, Session(rig)))
    jaw = rig.joints.names.index("jaw")
    openings = np.array([abs(pose.rotations[jaw, 0]) for pose in solved])
    assert openings[60:70].max() > 0.05
    assert openings[-1] < 0.2 * openings[60:70].max()
    assert all(np.isfinite(pose.rotations).all() and np.isfinite(pose.translations).all() for pose in solved)


def test_the_same_clip_twice_gives_the_same_frames() -> None:
    for first, second in zip(clip_frames(), read_clip(), strict=True):
        np.testing.assert_array_equal(first.positions, second.positions)


def test_the_focal_length_sets_the_distance() -> None:
    clips.need(*MODELS)
    away = []
    for focal_px in (150.0, 300.0):
        with CameraSource(str(clips.carphone()), focal_px=focal_px) as source:
            away.append(-next(iter(source)).positions[[33, 263], 2].mean())
    assert away[1] / away[0] == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize("name", ["dlib", "lbf", "lbf:", ""])
def test_an_unknown_detector_is_told_with_those_there_are(name: str) -> None:
    with pytest.raises(InputError, match="mediapipe468"):
        make_detector(name)


def test_a_missing_model_is_told_before_the_camera_is_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(InputError, match="fetch it once with `retarget models"):
        CameraSource("camera:0")


def test_pictures_are_shown_with_the_landmarks_of_the_same_instant() -> None:
    clips.need(*MODELS)
    with CameraSource(str(clips.carphone())) as source, FilmPictures(clips.carphone()) as film:
        for frame, picture in itertools.islice(zip(source, film, strict=True), 5):
            assert source.seen is not None
            assert source.seen.picture.number == frame.number == picture.number
            np.testing.assert_array_equal(source.seen.picture.image, picture.image)
            assert source.seen.landmarks is not None
