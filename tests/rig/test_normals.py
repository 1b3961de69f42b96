"""Normals against a loop over triangles; seams, hard edges, lips."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.sparse import csr_array

from retarget.rig.normals import SmoothNormals, vertex_normals, weld
from retarget.rig.skinning import Skin
from tests.rig.tubes import make_pose, random_pose, random_surface, tube

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def naive(positions: NDArray[np.floating], triangles: NDArray[np.int32], groups: NDArray[np.intp]) -> Array:
    """The area-weighted mean, one triangle and one vertex at a time."""
    normals = np.zeros((len(positions), 3))
    for v in range(len(positions)):
        for triangle in triangles:
            a, b, c = positions[triangle].astype(float)
            touches = sum(groups[corner] == groups[v] for corner in triangle)
            normals[v] += touches * np.cross(b - a, c - a)
    unit: Array = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return unit


def ball(rows: int = 17, columns: int = 24) -> tuple[Array, NDArray[np.int32]]:
    """Unit ball whose first and last column of vertices are the same places, as a texture's seam makes them."""
    latitude = np.linspace(0.02, np.pi - 0.02, rows)[:, None]
    longitude = np.linspace(0, 2 * np.pi, columns)[None]
    points: Array = np.stack(
        [np.sin(latitude) * np.cos(longitude), np.cos(latitude) + 0 * longitude, np.sin(latitude) * np.sin(longitude)],
        -1,
    )
    points[:, -1] = points[:, 0]
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij"))
    a = i * columns + j
    triangles = np.concatenate(
        [np.stack([a, a + 1, a + columns], 1), np.stack([a + 1, a + columns + 1, a + columns], 1)]
    )
    flat: Array = points.reshape(-1, 3)
    return flat, triangles.astype(np.int32)


@pytest.mark.parametrize("seed", range(3))
def test_normals_agree_with_a_loop_over_triangles(seed: int) -> None:
    surface = random_surface(np.random.default_rng(seed), 3)
    groups = np.arange(60)
    groups[[10, 20]] = 5
    normals = SmoothNormals(surface.triangles, groups, surface.normals)(surface.positions)
    assert normals.dtype == np.float32
    np.testing.assert_allclose(normals, naive(surface.positions, surface.triangles, groups), atol=1e-4)


def test_normals_of_a_ball_point_outwards_on_the_seam_as_elsewhere() -> None:
    points, triangles = ball()
    normals = vertex_normals(points, triangles)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    inside = np.abs(points[:, 1]) < 0.95
    assert np.einsum("vi,vi->v", normals, points)[inside].min() > np.cos(np.radians(3))
    grid = normals.reshape(17, 24, 3)
    np.testing.assert_array_equal(grid[:, 0], grid[:, -1])


def test_a_vertex_without_area_keeps_the_normal_it_had() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], np.float32)
    rest = np.tile(np.array([0.6, 0, 0.8], np.float32), (4, 1))
    smooth = SmoothNormals(np.array([[0, 1, 2]], np.int32), np.arange(4), rest)
    np.testing.assert_allclose(smooth(positions), [[0, 0, 1]] * 3 + [[0.6, 0, 0.8]], atol=1e-7)
    np.testing.assert_array_equal(smooth(np.zeros((4, 3), np.float32)), rest)


def test_triangles_of_a_tenth_of_a_millimetre_still_have_normals() -> None:
    positions = 1e-4 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    smooth = SmoothNormals(np.array([[0, 1, 2]], np.int32), np.arange(3), np.zeros((3, 3), np.float32))
    np.testing.assert_allclose(smooth(positions), [[0, 0, 1]] * 3, atol=1e-6)


def test_welding_joins_the_halves_of_a_split_vertex_only() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 0], [0, 0, 1e-7], [1, 0, 0]], np.float32)
    np.testing.assert_array_equal(weld(positions), [0, 1, 0, 3, 1])


def test_a_hard_edge_stays_hard_and_a_seam_beside_it_is_welded() -> None:
    up, side = [0, 1, 0], [1, 0, 0]
    normals = np.array([up, side, up, side, [0.05, 1, 0]], np.float32)
    np.testing.assert_array_equal(weld(np.zeros((5, 3), np.float32), normals), [0, 1, 0, 1, 0])


def test_lips_that_touch_at_rest_stay_two_lips() -> None:
    motion = csr_array(np.array([[1, 0], [0, 1], [1, 0], [0.99995, 0.00005]], np.float32))
    np.testing.assert_array_equal(weld(np.zeros((4, 3), np.float32), motion=motion), [0, 1, 0, 0])


def test_many_different_vertices_at_one_place_end_in_a_bounded_time() -> None:
    count = 5_000
    motion = csr_array(np.arange(count, dtype=np.float32)[:, None])
    groups = weld(np.zeros((count, 3), np.float32), motion=motion)
    np.testing.assert_array_equal(groups, np.arange(count))


def doubled(values: NDArray[Any], rows: NDArray[np.intp]) -> NDArray[Any]:
    return np.concatenate([values, values[rows]])


def test_the_seam_of_a_skinned_surface_stays_closed_in_every_pose() -> None:
    rig = tube()
    (surface,) = rig.surfaces
    first = np.arange(0, len(surface.positions), 32)
    twins = len(surface.positions) + np.arange(len(first))
    triangles = surface.triangles.copy()
    right = (triangles % 32 == 31).any(axis=1)
    for vertex, twin in zip(first, twins, strict=True):
        triangles[right] = np.where(triangles[right] == vertex, twin, triangles[right])
    split = replace(
        surface,
        triangles=triangles,
        positions=doubled(surface.positions, first),
        normals=doubled(surface.normals, first),
        joints=doubled(surface.joints, first),
        joint_weights=doubled(surface.joint_weights, first),
    )
    pose = random_pose(np.random.default_rng(4), rig)
    whole, cut = Skin(rig)(pose), Skin(replace(rig, surfaces=(split,)))(pose)
    np.testing.assert_array_equal(cut.normals[0][first], cut.normals[0][twins])
    np.testing.assert_allclose(cut.normals[0][: len(surface.positions)], whole.normals[0], atol=1e-5)


def test_a_border_between_two_surfaces_is_welded_too() -> None:
    rig = tube()
    (surface,) = rig.surfaces
    left, right = np.split(surface.triangles, 2)
    halves = replace(rig, surfaces=(replace(surface, triangles=left), replace(surface, triangles=right)))
    whole, parts = Skin(rig)(make_pose(rig)), Skin(halves)(make_pose(halves))
    for normals in parts.normals:
        np.testing.assert_allclose(normals, whole.normals[0], atol=1e-6)
