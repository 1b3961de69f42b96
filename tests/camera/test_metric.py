"""Metres: known truth through a pinhole, and mediapipe's own face geometry."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from retarget.camera import ibug68
from retarget.camera.canonical import CanonicalFace, load_canonical_face, parse_canonical_face
from retarget.camera.landmarks import IBUG68, MESH478, Landmarks
from retarget.camera.metric import MeshDepth, PosedDepth
from retarget.errors import InputError
from retarget.geometry import apply, transform, umeyama
from tests.camera import clips, oracles

SIZE = (640, 480)


@pytest.fixture(scope="module")
def face() -> CanonicalFace:
    clips.need("face_geometry")
    return load_canonical_face()


def project(points: np.ndarray, focal_px: float) -> np.ndarray:
    """(N, 2) [px] of points (N, 3) [m] before the camera, in the house's axes."""
    pixels: np.ndarray = np.array(SIZE) / 2 + points[:, :2] * [focal_px, -focal_px] / -points[:, 2:]
    return pixels


def test_the_canonical_face_looks_out_along_z_and_is_symmetric(face: CanonicalFace) -> None:
    points = face.points
    assert points[1, 2] > points[[33, 263, 234, 454], 2].max()
    assert points[263, 0] > 0 > points[33, 0]
    assert points[10, 1] > points[152, 1]
    np.testing.assert_allclose(points[263], points[33] * [-1, 1, 1], atol=1e-6)
    assert face.weights.sum() == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("cut", [0, 1, 7, 1000, 19000, 19100, 19375])
def test_a_geometry_file_that_is_cut_is_refused(face: CanonicalFace, cut: int) -> None:
    from retarget.camera.models import model_path

    with pytest.raises(InputError, match="is not the geometry"):
        parse_canonical_face(model_path("face_geometry").read_bytes()[:cut], "it")


def test_the_heads_place_is_that_of_mediapipes_face_geometry(face: CanonicalFace) -> None:
    oracle = oracles.mediapipe()
    focal_px = 144 / 2 / np.tan(np.radians(63 / 2))  # the camera that mediapipe takes for granted
    metres = MeshDepth(face, (176, 144), focal_px)
    rigid = np.flatnonzero(face.weights)
    turns, places = [], []
    for points, theirs in zip(oracle["landmarks478_px"].astype(float), oracle["facial_transformation"], strict=True):
        placed = metres(Landmarks(MESH478, points, 1.0))
        T, scale = umeyama(face.points[rigid], placed[rigid], face.weights[rigid])
        assert scale == pytest.approx(1.0, abs=1e-6)
        turns.append(Rotation.from_matrix(theirs[:3, :3].T @ T[:3, :3]).magnitude())
        places.append(T[:3, 3] - theirs[:3, 3] / 100)
    assert np.degrees(max(turns)) < 0.2
    assert np.abs(places).max() < 0.002  # at 0.4 m


def test_a_mesh_seen_from_afar_comes_back_in_shape_and_place(face: CanonicalFace) -> None:
    """The mesh's depth is drawn as if without perspective, so truth is only met where there is little of it."""
    truth = apply(transform(Rotation.from_euler("yx", [0.3, 0.1]).as_matrix(), [0.05, -0.02, -3.0]), face.points)
    focal_px = 4000.0
    pixels = project(truth, focal_px)
    depth = -(truth[:, 2:] + 3.0) * focal_px / 3.0
    placed = MeshDepth(face, SIZE, focal_px)(Landmarks(MESH478, np.hstack([pixels, depth]), 1.0))
    _, scale = umeyama(face.points, placed)
    assert scale == pytest.approx(1.0, abs=2e-3)
    assert np.abs(placed - truth)[:, :2].max() < 1e-3
    np.testing.assert_allclose(placed[:, 2], truth[:, 2], atol=0.02)


@pytest.mark.parametrize("yaw", [-0.6, 0.0, 0.4])
def test_68_points_of_a_posed_face_come_back_to_a_tenth_of_a_millimetre(face: CanonicalFace, yaw: float) -> None:
    still = ibug68.from_mesh(face.points)
    truth = apply(transform(Rotation.from_euler("yx", [yaw, 0.15]).as_matrix(), [0.05, -0.02, -0.6]), still)
    points = np.column_stack([project(truth, 640.0), np.full(68, np.nan)])
    placed = PosedDepth(face, SIZE)(Landmarks(IBUG68, points, 1.0))
    assert np.abs(placed - truth).max() < 1e-4


def test_what_is_not_seen_stays_nan(face: CanonicalFace) -> None:
    metres = PosedDepth(face, SIZE)
    truth = ibug68.from_mesh(face.points) + np.array([0, 0, -0.6])
    points = np.column_stack([project(truth, 640.0), np.full(68, np.nan)])
    points[[51, 57]] = np.nan
    placed = metres(Landmarks(IBUG68, points, 1.0))
    assert np.isnan(placed[[51, 57]]).all()
    assert np.isfinite(np.delete(placed, [51, 57], axis=0)).all()
    assert np.isnan(metres(Landmarks(IBUG68, np.full((68, 3), np.nan), 0.0))).all()
    assert np.isnan(MeshDepth(face, SIZE)(Landmarks(MESH478, np.full((478, 3), np.nan), 0.0))).all()
