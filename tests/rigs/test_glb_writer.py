"""The GLB writer, read back with pygltflib: geometry, skin, sparse shapes, pictures."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from rigs.recipe.glb import Look, write_glb
from rigs.recipe.paint import png
from rigs.recipe.part import Part, join, rigid, vertex_normals
from rigs.recipe.skeleton import Skeleton
from tests.rigs.glb import read

if TYPE_CHECKING:
    from pathlib import Path

SKELETON = Skeleton(("root", "tip"), (-1, 0), np.array([[0, 0.1, 0], [0, 0.3, 0.05]]))
SHAPES = ("lift", "rest", "turn")


def triangle(joint: int, shapes: dict[str, float]) -> Part:
    """One triangle that every named shape moves upwards by a distance."""
    at = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    triangles = np.array([[0, 1, 2]])
    offsets = {name: np.array([[0, 0, 0], [0, up, 0], [0, up, 0]]) for name, up in shapes.items()}
    return Part("part", at, vertex_normals(at, triangles), at[:, :2], triangles, *rigid(3, joint), offsets)


def write(path: Path) -> bytes:
    part = join("both", [triangle(0, {"lift": 0.2}), triangle(1, {"turn": 0.3})])
    look = Look(png(np.full((2, 2, 3), 90, dtype=np.uint8)), 0.5)
    data = write_glb("test", [part], [look], SKELETON, SHAPES, {})
    path.write_bytes(data)
    return data


def test_what_was_written_is_read_back(tmp_path: Path) -> None:
    write(tmp_path / "a.glb")
    model = read(tmp_path / "a.glb")
    surface = model.surfaces["both"]
    np.testing.assert_array_equal(surface.triangles, [[0, 1, 2], [3, 4, 5]])
    np.testing.assert_allclose(surface.normals, np.tile([0, 0, 1], (6, 1)))
    np.testing.assert_array_equal(surface.joints[:, 0], [0, 0, 0, 1, 1, 1])
    np.testing.assert_allclose(model.places["tip"], [0, 0.3, 0.05], atol=1e-7)
    np.testing.assert_allclose(model.inverse_bind[1][:3, 3], [0, -0.3, -0.05], atol=1e-7)


def test_shapes_are_kept_sparse_and_in_order(tmp_path: Path) -> None:
    write(tmp_path / "a.glb")
    model = read(tmp_path / "a.glb")
    assert tuple(model.shape_names) == SHAPES
    lift, rest, turn = model.surfaces["both"].targets
    np.testing.assert_allclose(lift[:, 1], [0, 0.2, 0.2, 0, 0, 0], atol=1e-7)
    np.testing.assert_array_equal(rest, 0)
    np.testing.assert_allclose(turn[:, 1], [0, 0, 0, 0, 0.3, 0.3], atol=1e-7)


def test_the_picture_is_embedded(tmp_path: Path) -> None:
    write(tmp_path / "a.glb")
    document = read(tmp_path / "a.glb").document
    view = document.bufferViews[document.images[0].bufferView]
    data = document.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    assert Image.open(io.BytesIO(data)).getpixel((0, 0)) == (90, 90, 90)


def test_the_same_parts_give_the_same_bytes(tmp_path: Path) -> None:
    assert write(tmp_path / "a.glb") == write(tmp_path / "b.glb")
