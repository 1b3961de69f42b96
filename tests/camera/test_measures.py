"""Measures: by hand, and against the expressions that mediapipe saw in the same pictures."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from retarget.camera.canonical import load_canonical_face
from retarget.camera.landmarks import MESH478, Landmarks
from retarget.camera.measures import MeshMeasures, mesh_measures, openvhead_measures, reference_length
from retarget.camera.metric import MeshDepth
from tests.camera import clips, oracles


def test_openvheads_measures_follow_its_formulas() -> None:
    rng = np.random.default_rng(6)
    p = rng.uniform(0, 400, (68, 2))

    def d(a: int, b: int) -> float:
        return float(np.hypot(*(p[a] - p[b])))

    reference = (d(27, 8) + d(0, 16)) / 2
    assert reference_length(p) == pytest.approx(reference, rel=1e-12)
    np.testing.assert_allclose(
        openvhead_measures(p),
        [
            6 * ((d(37, 41) + d(38, 40)) / (2 * reference) - 0.02),
            6 * ((d(43, 47) + d(44, 46)) / (2 * reference) - 0.02),
            1.27 * (d(51, 57) / reference - 0.13) + 0.02,
            d(60, 64) / reference,
        ],
        rtol=1e-12,
    )


@pytest.fixture(scope="module")
def seen() -> tuple[MeshMeasures, dict[str, np.ndarray]]:
    """Our measures of mediapipe's points, each (120,), and its weights by name."""
    oracle = oracles.mediapipe()
    clips.need("face_geometry")
    metres = MeshDepth(load_canonical_face(), (176, 144))
    points = oracle["landmarks478_px"].astype(float)
    ours = np.array([mesh_measures(metres(Landmarks(MESH478, each, 1.0))) for each in points])
    weights = dict(zip(oracle["blendshape_names"], oracle["blendshapes"].T, strict=True))
    return MeshMeasures(*ours.T), weights


@pytest.mark.parametrize(
    ("ours", "theirs", "least"),
    [
        ("eye_left", "-eyeBlinkLeft", 0.85),
        ("eye_right", "-eyeBlinkRight", 0.85),
        ("mouth_open", "jawOpen", 0.9),
        ("jaw_open", "jawOpen", 0.6),
        ("gaze_across", "eyeLookOutLeft", 0.9),
        ("gaze_across", "eyeLookInRight", 0.9),
        ("gaze_across", "-eyeLookInLeft", 0.75),
        ("gaze_up", "-eyeLookDownLeft", 0.7),
        ("brow_right", "browOuterUpRight", 0.6),
        ("mouth_width", "-mouthPucker", 0.6),
    ],
)
def test_measures_rise_and_fall_with_what_mediapipe_sees(
    seen: tuple[MeshMeasures, dict[str, np.ndarray]], ours: str, theirs: str, least: float
) -> None:
    measures, weights = seen
    sign = -1 if theirs.startswith("-") else 1
    assert sign * np.corrcoef(getattr(measures, ours), weights[theirs.lstrip("-")])[0, 1] > least


def test_a_blink_closes_the_measured_eye(seen: tuple[MeshMeasures, dict[str, np.ndarray]]) -> None:
    measures, _ = seen
    assert np.min(measures.eye_left) < 0.1 < 0.3 < np.median(measures.eye_left)


def face() -> np.ndarray:
    clips.need("face_geometry")
    points = np.full((478, 3), np.nan)
    points[:468] = load_canonical_face().points
    points[468], points[473] = points[[33, 133]].mean(axis=0), points[[263, 362]].mean(axis=0)
    return points


def test_measures_stay_when_the_head_turns_and_comes_nearer() -> None:
    points = face()
    turned = 3.0 * points @ Rotation.from_euler("xyz", [0.3, -0.5, 0.2]).as_matrix().T + [1, 2, 3]
    np.testing.assert_allclose(mesh_measures(turned), mesh_measures(points), atol=1e-9)


def test_a_canonical_face_looks_ahead_with_its_eyes_open_and_its_lips_hardly_apart() -> None:
    still = mesh_measures(face())
    assert still.gaze_across == pytest.approx(0.0, abs=1e-3)
    assert still.eye_left == pytest.approx(still.eye_right, abs=1e-3)
    assert still.eye_left > 0.2
    assert still.mouth_open < 0.08


def test_measures_move_the_way_their_names_say() -> None:
    points = face()
    still = mesh_measures(points)
    points[[468, 473]] += [0.004, 0.002, 0]
    points[[293, 334, 296], 1] += 0.005
    points[[61, 291], 1] += 0.004
    points[[14, 17, 152], 1] -= 0.01
    moved = mesh_measures(points)
    for name in ("gaze_across", "gaze_up", "brow_left", "smile", "mouth_open", "jaw_open"):
        assert getattr(moved, name) > getattr(still, name) + 0.02, name
    assert moved.brow_right == pytest.approx(still.brow_right, abs=5e-3)


def test_what_a_measure_needs_and_is_not_seen_makes_it_nan() -> None:
    points = face()
    points[[468, 473]] = np.nan
    measures = mesh_measures(points)
    assert np.isnan(measures.gaze_across)
    assert np.isfinite(measures.eye_left)
