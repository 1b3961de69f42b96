"""The mesh by OpenCV alone, against mediapipe itself on the carphone clip."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest

from retarget.camera.blendshape_net import NAMES, BlendshapeNet
from retarget.camera.canonical import load_canonical_face
from retarget.camera.face_mesh import FaceMesh
from retarget.camera.files import FilmPictures
from retarget.camera.landmarks import IBUG68, MESH478, Landmarks
from retarget.camera.metric import MeshDepth
from retarget.errors import InputError
from retarget.frames import MarkerFrame
from tests.camera import clips, oracles

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.camera.face_mesh import MeshPoints, Search

    Array = NDArray[np.float64]

EVERY = 4
"""Pictures a test looks at one of; following needs them all."""


def meshes(points: MeshPoints, search: Search, every: int) -> list[Landmarks]:
    clips.need("face_detector", f"face_mesh{points}")
    detect = FaceMesh(points, search)
    with FilmPictures(clips.carphone()) as film:
        found = [detect(picture.image) for picture in film if picture.number % every == 0]
    seen = [landmarks for landmarks in found if landmarks is not None]
    assert len(seen) == len(found)
    return seen


def error_in_eye_distances(ours: Array, theirs: Array) -> float:
    eyes = np.linalg.norm(theirs[:, 33, :2] - theirs[:, 263, :2], axis=1).mean()
    return float(np.linalg.norm((ours - theirs)[..., :2], axis=2).mean() / eyes)


def test_478_points_and_51_weights_are_those_of_mediapipes_picture_mode() -> None:
    oracle = oracles.mediapipe()
    clips.need("face_blendshapes")
    net = BlendshapeNet()
    found = meshes(478, "every picture", EVERY)
    ours = np.array([landmarks.points for landmarks in found])
    assert error_in_eye_distances(ours, oracle["landmarks478_px"][::EVERY]) < 0.001
    weights = np.array([net(landmarks) for landmarks in found])
    assert tuple(oracle["blendshape_names"][1:]) == NAMES
    assert np.abs(weights - oracle["blendshapes"][::EVERY, 1:]).mean() < 0.002


def test_468_points_followed_from_picture_to_picture_are_those_of_mediapipes_video_mode() -> None:
    oracle = oracles.mediapipe()["mesh468_px"]
    found = meshes(468, "when lost", 1)
    ours = np.array([landmarks.points for landmarks in found])
    assert np.isnan(ours[:, 468:]).all()
    assert error_in_eye_distances(ours[:, :468], oracle) < 0.001
    np.testing.assert_allclose(ours[:, :468, 2], oracle[..., 2], atol=0.2)


def test_the_weights_for_mediapipes_own_points_are_its_own() -> None:
    oracle = oracles.mediapipe()
    clips.need("face_blendshapes")
    net = BlendshapeNet()
    points = oracle["landmarks478_px"].astype(float)[::EVERY]
    weights = np.array([net(Landmarks(MESH478, each, 1.0)) for each in points])
    np.testing.assert_allclose(weights, oracle["blendshapes"][::EVERY, 1:], atol=1e-4)


def test_weights_come_as_well_from_metres_that_went_over_the_network() -> None:
    points = oracles.mediapipe()["landmarks478_px"].astype(float)[::EVERY]
    clips.need("face_blendshapes", "face_geometry")
    net, metres = BlendshapeNet(), MeshDepth(load_canonical_face(), (176, 144))
    for each in points:
        landmarks = Landmarks(MESH478, each, 1.0)
        frame = MarkerFrame(0, 0.0, 0.0, MESH478, metres(landmarks))
        np.testing.assert_allclose(net.of_frame(frame), net(landmarks), atol=1e-3)
    with pytest.raises(InputError, match="need mediapipe478"):
        net.of_frame(MarkerFrame(0, 0.0, 0.0, IBUG68, np.zeros((68, 3))))


def test_without_a_face_or_without_irises_there_are_no_weights() -> None:
    clips.need("face_blendshapes")
    net = BlendshapeNet()
    points = np.ones((478, 3))
    points[468:] = np.nan
    assert np.isnan(net(None)).all()
    assert np.isnan(net(Landmarks(MESH478, points, 1.0))).all()


def test_a_picture_without_a_face_gives_none_and_the_face_is_found_again() -> None:
    clips.need("face_detector", "face_mesh478")
    detect = FaceMesh()
    with FilmPictures(clips.carphone()) as film:
        picture = next(iter(film)).image
    assert detect(picture) is not None
    assert detect(np.zeros_like(picture)) is None
    assert detect(picture[:8, :8]) is None
    assert detect(picture) is not None


def test_the_face_is_found_wherever_it_is_in_a_larger_picture() -> None:
    clips.need("face_detector", "face_mesh478")
    with FilmPictures(clips.carphone()) as film:
        picture = next(iter(film)).image
    large = np.zeros((600, 900, 3), np.uint8)
    large[100 : 100 + 288, 400 : 400 + 352] = cv2.resize(picture, (352, 288), interpolation=cv2.INTER_LINEAR)
    plain, found = FaceMesh()(picture), FaceMesh()(large)
    assert plain is not None
    assert found is not None
    eyes = np.linalg.norm(plain.points[33, :2] - plain.points[263, :2])
    error = np.linalg.norm((found.points[:, :2] - [400, 100]) / 2 - plain.points[:, :2], axis=1).mean()
    assert error < 0.05 * eyes
