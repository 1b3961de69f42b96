"""Folders of OBJ shapes: units, polygons, halves; what is wrong is told."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pygltflib
import pytest

from retarget.errors import InputError
from retarget.rig.adopt import adopt
from retarget.rig.load import load_rig
from retarget.rig.obj_folder import read_obj_folder
from retarget.rig.write_glb import glb_bytes

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

CORNERS = np.array([[-12.0, 0, 0], [12, 0, 0], [12, 28, 0], [-12, 28, 0], [0, 14, 9]])
"""Centimetres."""
FACES = "f 1 2 5\nf 2//1 3//1 5//1\nf 3/1/1 4/1/1 -1/1/1\nf 4 1 5\n"


def write(path: Path, vertices: NDArray[np.float64], faces: str = FACES) -> None:
    lines = "".join(f"v {x} {y} {z}\n" for x, y, z in vertices)
    path.write_text(f"# made by hand\no face\n{lines}vt 0 0\nvn 0 0 1\n{faces}")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "ict"
    folder.mkdir()
    write(folder / "generic_neutral_mesh.obj", CORNERS)
    for name, vertex, shift in (
        ("jawOpen", 0, (0, -2, 0)),
        ("browInnerUp_L", 2, (0, 1, 0)),
        ("browInnerUp_R", 3, (0, 1, 0)),
        ("mouthSmile_L", 4, (1, 0, 0)),
        ("eyeBlink_R", 1, (0, 0, 1)),
    ):
        moved = CORNERS.copy()
        moved[vertex] += shift
        write(folder / f"{name}.obj", moved)
    return folder


def test_shapes_are_differences_to_the_neutral_in_metres(folder: Path) -> None:
    mesh = read_obj_folder(folder)
    np.testing.assert_allclose(mesh.positions, CORNERS / 100, atol=1e-7)
    assert set(mesh.shapes) == {"jawOpen", "browInnerUp_L", "browInnerUp_R", "mouthSmile_L", "eyeBlink_R"}
    expected = np.zeros((5, 3))
    expected[0, 1] = -0.02
    np.testing.assert_allclose(mesh.shapes["jawOpen"], expected, atol=1e-7)


def test_faces_of_every_way_to_write_them_are_read(folder: Path) -> None:
    assert read_obj_folder(folder).triangles.tolist() == [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]


def test_polygons_become_fans(folder: Path) -> None:
    write(folder / "generic_neutral_mesh.obj", CORNERS, "f 1 2 3 4\n")
    assert read_obj_folder(folder).triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("factor", [1.0, 10.0, 0.01])
def test_the_unit_is_the_one_that_makes_it_a_head(factor: float, folder: Path) -> None:
    for path in folder.iterdir():
        lines = path.read_text().splitlines()
        vertices = [[float(x) * factor for x in line.split()[1:]] for line in lines if line.startswith("v ")]
        write(path, np.array(vertices))
    assert np.ptp(read_obj_folder(folder).positions[:, 1]) == pytest.approx(0.28, rel=1e-5)


def test_the_glb_that_it_becomes_is_read_by_others(folder: Path, tmp_path: Path) -> None:
    mesh = read_obj_folder(folder)
    (tmp_path / "a.glb").write_bytes(glb_bytes(mesh))
    gltf = pygltflib.GLTF2().load(str(tmp_path / "a.glb"))
    assert gltf.meshes[0].extras["targetNames"] == list(mesh.shapes)
    accessor = gltf.accessors[gltf.meshes[0].primitives[0].attributes.POSITION]
    view = gltf.bufferViews[accessor.bufferView]
    got = np.frombuffer(gltf.binary_blob(), "<f4", 15, view.byteOffset).reshape(-1, 3)
    np.testing.assert_array_equal(got, mesh.positions)


def test_a_folder_becomes_a_rig_whose_halves_are_one_shape(folder: Path, tmp_path: Path) -> None:
    adoption = adopt(folder, tmp_path / "rigs")
    rig = load_rig(str(adoption.folder))
    assert set(rig.shape_names) == {"jawOpen", "browInnerUp", "mouthSmileLeft", "eyeBlinkRight"}
    brow = rig.surfaces[0].shapes[rig.shape_names.index("browInnerUp")]
    assert brow.vertices.tolist() == [2, 3]
    np.testing.assert_allclose(brow.offsets, [[0, 0.01, 0]] * 2, atol=1e-7)


def test_folders_that_are_none_are_refused_in_one_sentence(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="0 OBJ files, 0 of them with 'neutral'"):
        read_obj_folder(tmp_path / "empty")
    write(folder / "other.obj", CORNERS[:4])
    with pytest.raises(InputError, match=r"other\.obj has 4 vertices and generic_neutral_mesh\.obj 5"):
        read_obj_folder(folder)


@pytest.mark.parametrize("face", ["f 1 2 9\n", "f 1 2\n", "f 0 1 2\n", "f a b c\n", ""])
def test_faces_that_point_nowhere_are_refused(face: str, folder: Path) -> None:
    write(folder / "generic_neutral_mesh.obj", CORNERS, face)
    with pytest.raises(InputError, match="face"):
        read_obj_folder(folder)


@pytest.mark.parametrize("vertex", ["v 1 2\n", "v 1 2 x\n", "v nan 0 0\n", "v 1e300 0 0\n"])
def test_vertices_that_are_no_numbers_are_refused(vertex: str, folder: Path) -> None:
    path = folder / "jawOpen.obj"
    path.write_text(path.read_text() + vertex)
    with pytest.raises(InputError, match="three finite numbers"):
        read_obj_folder(folder)
