"""Which nodes become joints, where they stand, and hierarchies that are none."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError
from tests.rig.glb_files import TRIANGLE, read_mesh, rewrite_json, two_joint_file

if TYPE_CHECKING:
    from pathlib import Path


def test_parents_stand_before_children_whatever_the_order_of_the_file(tmp_path: Path) -> None:
    file = two_joint_file()
    nodes = file.gltf.nodes
    file.gltf.nodes = [nodes[1], nodes[0], nodes[2]]
    nodes[0].children, file.gltf.scenes[0].nodes, file.gltf.skins[0].joints = [0], [1, 2], [1, 0]
    joints, _, _ = read_mesh(file.save(tmp_path / "a.glb"))
    assert joints.names == ("head", "jaw")
    assert list(joints.parents) == [-1, 0]
    np.testing.assert_allclose(joints.T_rig_joint[:, 1, 3], [1.0, 0.5])


def test_a_node_that_the_rig_names_is_a_joint_without_a_skin(tmp_path: Path) -> None:
    file = two_joint_file()
    eye = file.node(0, name="eyeLeft", translation=[0.1, 0.2, 0.0])
    ball = file.mesh(np.eye(3, dtype=np.float32), TRIANGLE)
    file.node(eye, name="ball", mesh=ball, translation=[0.0, 0.0, 1.0])
    path = file.save(tmp_path / "a.glb")
    joints, surfaces, _ = read_mesh(path, "eyeLeft")
    assert joints.names == ("head", "jaw", "eyeLeft")
    assert surfaces[1].name == "ball"
    np.testing.assert_array_equal(surfaces[1].joints, np.full((3, 1), 2))
    np.testing.assert_allclose(surfaces[1].positions, np.eye(3) + np.array([0.1, 1.2, 1.0]), atol=1e-6)
    _, surfaces, _ = read_mesh(path)
    np.testing.assert_array_equal(surfaces[1].joints, np.zeros((3, 1)))


def test_a_named_joint_without_any_mesh_has_no_bind_matrix(tmp_path: Path) -> None:
    file = two_joint_file()
    file.node(0, name="locator")
    joints, _, _ = read_mesh(file.save(tmp_path / "a.glb"), "locator")
    assert np.isnan(joints.T_joint_mesh[joints.index("locator")]).all()


def test_a_mesh_named_as_its_joint_does_not_hide_the_joint(tmp_path: Path) -> None:
    file = two_joint_file()
    file.gltf.nodes[2].name = "head"
    joints, surfaces, _ = read_mesh(file.save(tmp_path / "a.glb"), "head")
    assert joints.names == ("head", "jaw")
    assert surfaces[0].name == "head"


def test_nodes_that_form_no_tree_are_refused(tmp_path: Path) -> None:
    for parent, child in ((1, 0), (2, 1), (1, 9)):
        file = two_joint_file()
        file.gltf.nodes[parent].children.append(child)
        with pytest.raises(InputError, match=r"a\.glb"):
            read_mesh(file.save(tmp_path / "a.glb"))


def test_the_last_row_of_a_matrix_is_not_taken_from_the_file(tmp_path: Path) -> None:
    file = two_joint_file()
    file.gltf.nodes[0].translation = None
    file.gltf.nodes[0].matrix = [1.0, 0.0, 0.0, 0.5, 0.0, 1.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.5, 0.0, 1.0, 0.0, 7.0]
    joints, _, _ = read_mesh(file.save(tmp_path / "a.glb"))
    np.testing.assert_allclose(joints.translations, [[0.0, 1.0, 0.0], [0.0, -0.5, 0.0]], atol=1e-7)


def test_two_joints_of_one_name_are_refused(tmp_path: Path) -> None:
    file = two_joint_file()
    file.gltf.nodes[1].name = "head"
    with pytest.raises(InputError, match="two joints named 'head'"):
        read_mesh(file.save(tmp_path / "a.glb"))


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30, "1", True])
@pytest.mark.parametrize("key", ["translation", "rotation", "scale", "matrix"])
def test_transforms_that_are_not_finite_numbers_are_refused_with_their_place(
    key: str, value: object, tmp_path: Path
) -> None:
    whole = two_joint_file().save(tmp_path / "a.glb").read_bytes()
    count = {"translation": 3, "rotation": 4, "scale": 3, "matrix": 16}[key]
    spoilt = rewrite_json(whole, lambda document: document["nodes"][1].update({key: [0.5] * (count - 1) + [value]}))
    (tmp_path / "a.glb").write_bytes(spoilt)
    with pytest.raises(InputError, match=rf"nodes\[1\]: '{key}' should be {count} numbers"):
        read_mesh(tmp_path / "a.glb")
