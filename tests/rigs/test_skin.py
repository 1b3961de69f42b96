"""Cutting and refining a closed surface of known form: a bottle with a neck that stands on its shoulders."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rigs.recipe.refine import refine
from rigs.recipe.skin import Skin, boundary_edges, close, cut_head

if TYPE_CHECKING:
    from numpy.typing import NDArray

AROUND, RINGS = 24, 30
TILT = np.radians(12)
PLANE = (np.array([0.0, 0.10, 0.0]), np.array([0.0, np.cos(TILT), np.sin(TILT)]))


def bottle() -> tuple[NDArray[Any], NDArray[Any]]:
    """Vertices and quads of a surface of revolution about y, open at both ends; y from 0 to 0.3 m."""
    y = np.linspace(0, 0.3, RINGS)
    radius = np.where(
        y < 0.06, 0.15, np.where(y < 0.18, 0.05, 0.09 * np.sqrt(np.clip(1 - ((y - 0.21) / 0.1) ** 2, 0, 1)))
    )
    angle = np.arange(AROUND) * 2 * np.pi / AROUND
    points = np.stack(
        [radius[:, None] * np.sin(angle), np.tile(y[:, None], AROUND), radius[:, None] * np.cos(angle)], axis=-1
    )
    here = np.arange(AROUND)
    ahead = np.roll(here, -1)
    quads = [
        np.stack([r * AROUND + here, r * AROUND + ahead, (r + 1) * AROUND + ahead, (r + 1) * AROUND + here], 1)
        for r in range(RINGS - 1)
    ]
    return points.reshape(-1, 3), np.concatenate(quads)


@pytest.fixture
def cut() -> tuple[Skin, NDArray[Any]]:
    vertices, quads = bottle()
    lid = len(vertices)
    vertices = np.vstack([vertices, [[0, 0.3, 0]]])
    top = (RINGS - 1) * AROUND
    cap = [[top + k, top + (k + 1) % AROUND, lid, lid] for k in range(AROUND)]
    quads = np.vstack([quads, cap])
    uv = np.stack([vertices[:, 0], vertices[:, 1]], axis=1)[quads]
    return cut_head(vertices, quads, uv, PLANE), vertices


def test_the_cut_is_one_loop_in_the_plane(cut: tuple[Skin, NDArray[Any]]) -> None:
    skin, vertices = cut
    rim = skin.positions(vertices)[skin.rim]
    np.testing.assert_allclose((rim - PLANE[0]) @ PLANE[1], 0, atol=1e-12)
    assert len(set(skin.rim.tolist())) == len(skin.rim) >= AROUND
    assert len(boundary_edges(skin.triangles)) == len(skin.rim)


def test_new_vertices_are_means_of_old_ones(cut: tuple[Skin, NDArray[Any]]) -> None:
    skin, _ = cut
    np.testing.assert_allclose(skin.lift.sum(axis=1), 1)
    assert skin.lift.min() >= 0


def test_the_shoulders_are_gone(cut: tuple[Skin, NDArray[Any]]) -> None:
    skin, vertices = cut
    assert ((skin.positions(vertices) - PLANE[0]) @ PLANE[1]).min() > -1e-9


def test_the_closed_head_has_no_open_edge_and_keeps_its_outside_out(cut: tuple[Skin, NDArray[Any]]) -> None:
    skin, vertices = cut
    whole = close(skin, vertices, PLANE[1])
    triangles = whole.triangles
    a, b, c = whole.positions(vertices)[triangles].transpose(1, 0, 2)
    flat = np.linalg.norm(np.cross(b - a, c - a), axis=1) < 1e-14
    assert len(boundary_edges(triangles[~flat])) == 0
    assert (a * np.cross(b, c)).sum() / 6 > 0


def test_refining_splits_long_edges_and_leaves_the_rim_and_no_gap(cut: tuple[Skin, NDArray[Any]]) -> None:
    skin, vertices = cut
    fine = refine(skin, vertices, 0.014)
    assert len(fine.triangles) > 1.5 * len(skin.triangles)
    np.testing.assert_array_equal(
        np.sort(boundary_edges(fine.triangles), 0), np.sort(boundary_edges(skin.triangles), 0)
    )
    np.testing.assert_allclose(fine.lift.sum(axis=1), 1)


def test_refined_vertices_come_nearer_to_the_round_form(cut: tuple[Skin, NDArray[Any]]) -> None:
    """On the cylinder of the neck a plain middle of an edge would lie inside by r (1 - cos(pi / 24))."""
    skin, vertices = cut
    fine = refine(skin, vertices, 0.0125)
    added = fine.positions(vertices)[skin.lift.shape[0] :]
    neck = added[(added[:, 1] > 0.125) & (added[:, 1] < 0.165)]
    chord = 0.05 * (1 - np.cos(np.pi / AROUND))
    assert len(neck) > 20
    assert np.abs(np.hypot(neck[:, 0], neck[:, 2]) - 0.05).max() < chord / 2
