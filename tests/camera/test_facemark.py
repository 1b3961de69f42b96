"""The second detector. Its model is the user's and not here, so what OpenCV reads from it is stood in for."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest

from retarget.camera.facemark import Facemark
from retarget.camera.files import FilmPictures
from retarget.camera.ibug68 import from_mesh
from retarget.camera.source import make_detector
from retarget.errors import InputError
from tests.camera import clips, oracles

if TYPE_CHECKING:
    from pathlib import Path


class FakeFacemark:
    """Puts all landmarks into the middle of the face's box."""

    def loadModel(self, _: str) -> None:
        print("loading")

    def fit(self, _: np.ndarray, boxes: np.ndarray) -> tuple[bool, list[np.ndarray]]:
        x, y, width, height = boxes[0]
        return True, [np.tile(np.array([[[x + width / 2, y + height / 2]]], np.float32), (1, 68, 1))]


@pytest.fixture
def detect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Facemark:
    monkeypatch.setattr(cv2.face, "createFacemarkLBF", FakeFacemark)
    model = tmp_path / "model.yaml"
    model.write_text("%YAML:1.0\n---\nn_landmarks: 68\n")
    return Facemark(model)


def test_every_picture_of_the_clip_shows_its_face_also_where_the_head_is_tilted(detect: Facemark) -> None:
    truth = from_mesh(oracles.mediapipe()["landmarks478_px"].astype(float))[:, :, :2]
    with FilmPictures(clips.carphone()) as film:
        for picture in film:
            if picture.number % 4:
                continue
            found = detect(picture.image)
            assert found is not None
            assert np.isnan(found.points[:, 2]).all()
            face = truth[picture.number]
            assert np.linalg.norm(found.points[0, :2] - face.mean(axis=0)) < 0.35 * np.ptp(face[:, 1])


def test_a_picture_without_a_face_gives_none(detect: Facemark) -> None:
    assert detect(np.zeros((144, 176, 3), np.uint8)) is None


def test_a_model_that_is_absent_or_none_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no LBF model"):
        make_detector(f"lbf:{tmp_path / 'none.yaml'}")
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("%YAML:1.0\n---\n")
    with pytest.raises(InputError, match="no model of FacemarkLBF"):
        make_detector(f"lbf:{wrong}")


def test_loading_prints_nothing_to_stdout(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    cut = tmp_path / "cut.yaml"
    cut.write_text("%YAML:1.0\n---\nn_landmarks: 68\n")
    with contextlib.suppress(InputError):
        make_detector(f"lbf:{cut}")
    assert capfd.readouterr().out == ""
