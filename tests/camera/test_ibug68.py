"""The 68 landmarks of a mesh, beside those that a detector of the 68 sees in the same pictures."""

from __future__ import annotations

import numpy as np

from retarget.camera import ibug68
from tests.camera import oracles

MISSED = (116, 117, 118)
"""Pictures of the clip in which OpenVHead's detector found no face."""
ENLARGED = 3
"""The clip was enlarged for OpenVHead."""


def test_landmarks_of_the_mesh_lie_where_a_detector_of_the_68_sees_them() -> None:
    theirs, _ = oracles.openvhead()
    mesh = np.delete(oracles.mediapipe()["landmarks478_px"].astype(float), MISSED, axis=0)
    ours = ibug68.from_mesh(mesh)[..., :2]
    eyes = np.linalg.norm(ours[:, 36] - ours[:, 45], axis=1).mean()
    error = np.linalg.norm(theirs / ENLARGED - ours, axis=2).mean(axis=0) / eyes
    assert error[17:].mean() < 0.04
    assert error[17:].max() < 0.08
    assert error[:17].mean() < 0.12  # the mesh follows the skull, the scheme its silhouette
    far = np.linalg.norm(theirs[:, None] / ENLARGED - ours[:, :, None], axis=3).mean(axis=0)
    assert (far[17:, 17:].argmin(axis=0) == np.arange(51)).mean() > 0.85


def test_every_landmark_has_a_vertex_of_its_own() -> None:
    assert len(set(ibug68.MESH_POINTS.tolist())) == ibug68.COUNT
    assert ibug68.from_mesh(np.zeros((5, 478, 3))).shape == (5, 68, 3)
