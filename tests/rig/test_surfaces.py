"""Files of an independent writer against the formula of the specification."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pygltflib as g
import pytest

from retarget.errors import InputError
from retarget.frames import Pose
from retarget.geometry import inverse, matrix_from_quat, quat_from_axis_angle, quat_from_matrix
from retarget.rig.load import load_rig
from retarget.rig.skinning import Skin
from tests.rig.glb_files import TRIANGLE, GlbFile, read_mesh, rewrite_json, two_joint_file

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def quat(*turn: float) -> list[float]:
    angle = float(np.linalg.norm(turn))
    return [float(v) for v in quat_from_axis_angle(np.array(turn) / angle, angle)]


class Scene:
    """A hard case for a loader, and the formula of the specification worked out node by node and vertex by vertex.

    The armature has scale and rotation; a node that is no joint stands between head and jaw; the second skin shares
    both joints, lists them the other way round, and was bound in another pose and unit than the skeleton rests in; a
    piece without skin hangs below the jaw.
    """

    def __init__(self, folder: Path) -> None:
        rng = np.random.default_rng(8)
        self.file = file = GlbFile()
        arm = file.node(name="arm", scale=[0.5, 0.5, 0.5], rotation=quat(0.3, 0.1, -0.2), translation=[0.1, 0.2, 0.3])
        head = file.node(arm, name="head", translation=[0.0, 1.0, 0.0], rotation=quat(0.0, 0.4, 0.0))
        between = np.eye(4)
        between[:3, :3], between[:3, 3] = matrix_from_quat(quat(0.0, 0.0, 0.5)), [0.2, 0.0, 0.1]
        spacer = file.node(head, name="spacer", matrix=[float(v) for v in between.T.ravel()])
        jaw = file.node(spacer, name="jaw", translation=[0.0, -0.4, 0.1], rotation=quat(0.2, 0.0, 0.0))
        hang = file.node(jaw, name="hang", translation=[0.0, 0.0, 0.3], scale=[2.0, 2.0, 2.0])
        self.joints = {"head": head, "jaw": jaw}
        rest = self.globals({})
        self.bind = {
            0: np.linalg.inv(np.stack([rest[head], rest[jaw]])),
            1: np.linalg.inv(np.stack([rest[jaw], rest[head]])) @ np.diag([0.01, 0.01, 0.01, 1]),
        }
        self.bind[1][0] = self.bind[1][0] @ self._turned()
        self.positions = [rng.normal(size=(6, 3)).astype(np.float32) for _ in range(3)]
        self.positions[1] *= 100
        self.offsets = [rng.normal(size=(6, 3)).astype(np.float32) for _ in range(3)]
        self.weights = [rng.integers(1, 255, (6, 8)).astype(np.uint8) for _ in range(2)]
        self.numbers = [rng.integers(0, 2, (6, 8)).astype(np.uint8) for _ in range(2)]
        at = np.array([1, 4], np.uint16)
        still = np.ones(6, np.bool_)
        still[at] = False
        self.offsets[0][still] = 0
        triangles = np.array([[0, 1, 2], [3, 4, 5]], np.uint16)
        sparse = file.sparse(at, self.offsets[0][at], 6)
        targets = [[sparse], [file.accessor(self.offsets[1])], [file.accessor(self.offsets[2])]]
        names = [("smile",), ("blink",), ("smile",)]
        for i in range(2):
            attributes = {}
            for s in range(2):
                part = np.s_[:, 4 * s : 4 * s + 4]
                attributes[f"JOINTS_{s}"] = file.accessor(np.ascontiguousarray(self.numbers[i][part]))
                weights = np.ascontiguousarray(self.weights[i][part])
                attributes[f"WEIGHTS_{s}"] = file.accessor(weights, normalized=True)
            mesh = file.mesh(self.positions[i], triangles, names[i], targets=targets[i], **attributes)
            joints = [head, jaw] if i == 0 else [jaw, head]
            file.node(
                arm, name=f"mesh{i}", mesh=mesh, skin=file.skin(joints, self.bind[i]), translation=[9.0, 9.0, 9.0]
            )
        file.gltf.nodes[hang].mesh = file.mesh(self.positions[2], triangles, names[2], targets=targets[2])
        self.hang = hang
        self.path = file.save(folder / "scene.glb")

    @staticmethod
    def _turned() -> Array:
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = matrix_from_quat(quat(0.0, 0.3, 0.3)), [0.5, 0.0, 0.0]
        return T

    def globals(self, turned: dict[int, tuple[Array, Array]]) -> dict[int, Array]:
        """Global transform of every node; `turned` replaces rotation and translation of some."""
        found: dict[int, Array] = {}

        def visit(n: int, above: Array) -> None:
            node = self.file.gltf.nodes[n]
            L = np.eye(4)
            if node.matrix:
                L = np.array(node.matrix).reshape(4, 4).T
            else:
                t, r = turned.get(n, (node.translation or [0, 0, 0], node.rotation or [0, 0, 0, 1]))
                L[:3, :3] = matrix_from_quat(np.array(r)) @ np.diag(node.scale or [1, 1, 1])
                L[:3, 3] = t
            found[n] = above @ L
            for child in node.children:
                visit(child, found[n])

        for root in self.file.gltf.scenes[0].nodes:
            visit(root, np.eye(4))
        return found

    def vertices(self, G: dict[int, Array], smile: float, blink: float) -> list[Array]:
        """Positions of the three meshes as the specification has it, in float64, one vertex at a time."""
        amounts = [smile, blink, smile]
        out = []
        for i in range(2):
            joints = ["head", "jaw"] if i == 0 else ["jaw", "head"]
            rows = []
            for v in range(6):
                p = np.append(self.positions[i][v] + amounts[i] * self.offsets[i][v].astype(float), 1.0)
                total = np.zeros(4)
                for k in range(8):
                    j = self.numbers[i][v, k]
                    share = self.weights[i][v, k] / self.weights[i][v].sum(dtype=float)
                    total += share * (G[self.joints[joints[j]]] @ (self.bind[i][j].astype(np.float32) @ p))
                rows.append(total[:3])
            out.append(np.array(rows))
        rows = [
            G[self.hang] @ np.append(p + smile * o, 1) for p, o in zip(self.positions[2], self.offsets[2], strict=True)
        ]
        return [*out, np.array(rows)[:, :3]]


def rigid(G: Array) -> Array:
    """The transform without its scale, which is the same along all axes here."""
    T = G.copy()
    T[:3, :3] /= np.cbrt(np.linalg.det(G[:3, :3]))
    return T


@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_posed_vertices_are_those_of_the_specifications_formula(turn: float, tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    (tmp_path / "rig.toml").write_text('name = "s"\nmesh = "scene.glb"\n[joints]\nhead = "head"\n')
    rig = load_rig(str(tmp_path))
    nodes = scene.file.gltf.nodes
    moved = {
        n: (np.array(nodes[n].translation) + turn * np.array([0.1, 0.2, 0.3]), np.array(quat(0.3, turn, 1e-3)))
        for n in scene.joints.values()
    }
    G = scene.globals(moved if turn else {})
    T_rig = {name: rigid(G[n]) for name, n in scene.joints.items()}
    T_local = {"head": T_rig["head"], "jaw": inverse(T_rig["head"]) @ T_rig["jaw"]}
    translations, rotations = rig.joints.translations.copy(), rig.joints.rotations.copy()
    for name, T in T_local.items():
        j = rig.joints.index(name)
        translations[j], rotations[j] = T[:3, 3], quat_from_matrix(T[:3, :3])
    weights = np.array([0.7, 0.3])
    assert rig.shape_names == ("smile", "blink")
    deformed = Skin(rig)(Pose(0, 0.0, 0.0, np.eye(4), translations, rotations, weights))
    for got, expected in zip(deformed.positions, scene.vertices(G, *weights), strict=True):
        np.testing.assert_allclose(got, expected, atol=2e-6)


def test_surfaces_bound_as_the_skeleton_rests_lie_in_the_rigs_frame_in_metres(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    _, surfaces, _ = read_mesh(scene.path)
    G = scene.globals({})
    for i in (0, 2):
        np.testing.assert_allclose(surfaces[i].positions, scene.vertices(G, 0, 0)[i], atol=1e-6)


def test_a_joint_bound_in_two_ways_gets_a_twin_that_rides_on_it(tmp_path: Path) -> None:
    joints, _, _ = read_mesh(Scene(tmp_path).path)
    assert joints.names[:2] == ("head", "jaw")
    assert all(".binding2" in name for name in joints.names[2:])
    for j in range(2, len(joints.names)):
        assert joints.names[j].startswith(joints.names[joints.parents[j]])
        np.testing.assert_allclose(joints.translations[j], 0, atol=1e-15)
        np.testing.assert_allclose(joints.rotations[j], [0, 0, 0, 1], atol=1e-15)


def test_skins_that_share_joints_bound_alike_share_the_rigs_joints(tmp_path: Path) -> None:
    file = two_joint_file()
    file.gltf.nodes.append(file.gltf.nodes[2])
    file.gltf.scenes[0].nodes.append(3)
    joints, surfaces, _ = read_mesh(file.save(tmp_path / "a.glb"))
    assert joints.names == ("head", "jaw")
    np.testing.assert_array_equal(surfaces[0].joints, surfaces[1].joints)


def test_a_file_without_skin_is_refused_with_what_to_do(tmp_path: Path) -> None:
    file = GlbFile()
    file.node(name="head", mesh=file.mesh(np.eye(3, dtype=np.float32), TRIANGLE))
    with pytest.raises(InputError, match=r"a\.glb has no skin and no blend shapes, so nothing would move its mesh; b"):
        read_mesh(file.save(tmp_path / "a.glb"), "head")


def test_strips_and_fans_are_the_triangles_they_stand_for(tmp_path: Path) -> None:
    expected = {5: [[0, 1, 2], [1, 3, 2], [2, 3, 4]], 6: [[1, 2, 0], [2, 3, 0], [3, 4, 0]]}
    for mode, triangles in expected.items():
        file = two_joint_file()
        positions = np.random.default_rng(0).normal(size=(5, 3)).astype(np.float32)
        joints, weights = np.zeros((5, 4), np.uint16), np.ones((5, 4), np.float32)
        primitive = g.Primitive(mode=mode)
        primitive.attributes = g.Attributes(
            POSITION=file.accessor(positions), JOINTS_0=file.accessor(joints), WEIGHTS_0=file.accessor(weights)
        )
        file.gltf.meshes[0].primitives = [primitive]
        _, surfaces, _ = read_mesh(file.save(tmp_path / "a.glb"))
        np.testing.assert_array_equal(surfaces[0].triangles, triangles)


def test_a_mirrored_piece_keeps_its_outside_outside(tmp_path: Path) -> None:
    file = two_joint_file()
    normals = file.accessor(np.tile(np.array([0, 0, 1], np.float32), (3, 1)))
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    for name, mesh in (
        ("given", file.mesh(corners, TRIANGLE, NORMAL=normals)),
        ("computed", file.mesh(corners, TRIANGLE)),
    ):
        file.node(0, name=name, mesh=mesh, scale=[-1.0, 1.0, 1.0])
    _, (_, given, computed), _ = read_mesh(file.save(tmp_path / "a.glb"))
    for surface in (given, computed):
        np.testing.assert_allclose(surface.normals, [[0, 0, 1]] * 3, atol=1e-6)
        a, b, c = surface.positions[surface.triangles[0]]
        assert np.cross(b - a, c - a)[2] > 0


def test_given_normals_turn_with_their_piece_and_stand_upright_on_stretched_ones(tmp_path: Path) -> None:
    file = two_joint_file()
    slope = np.array([[0, 0, 0], [1, 0, -1], [0, 1, 0]], np.float32)
    normals = np.tile(np.array([1, 0, 1], np.float32) / np.sqrt(np.float32(2)), (3, 1))
    mesh = file.mesh(slope, TRIANGLE, NORMAL=file.accessor(normals))
    file.node(0, name="piece", mesh=mesh, scale=[3.0, 1.0, 1.0], rotation=quat(0.0, 0.0, np.pi / 2))
    _, surfaces, _ = read_mesh(file.save(tmp_path / "a.glb"))
    np.testing.assert_allclose(surfaces[1].normals, np.tile([0, 1, 3] / np.sqrt(10), (3, 1)), atol=1e-6)


def test_a_vertex_without_weights_goes_with_the_skins_first_joint_and_weights_add_up(tmp_path: Path) -> None:
    file = two_joint_file()
    weights = np.array([[0, 0, 0, 0], [0.5, 0, 0, 0], [1, 1, 0, 0], [1, 0, 0, 0]], np.float32)
    file.gltf.meshes[0].primitives[0].attributes.WEIGHTS_0 = file.accessor(weights)
    _, (surface,), _ = read_mesh(file.save(tmp_path / "a.glb"))
    np.testing.assert_allclose(surface.joint_weights.sum(axis=1), 1)
    assert surface.joints[0][surface.joint_weights[0] > 0] == [0]
    assert surface.joints[1][surface.joint_weights[1] > 0] == [1]


def test_joint_numbers_beyond_the_skin_are_refused_unless_they_weigh_nothing(tmp_path: Path) -> None:
    for weight in (0.0, 0.1):
        file = two_joint_file()
        attributes = file.gltf.meshes[0].primitives[0].attributes
        attributes.JOINTS_0 = file.accessor(np.tile(np.array([1, 200, 0, 0], np.uint8), (4, 1)))
        attributes.WEIGHTS_0 = file.accessor(np.tile(np.array([1, weight, 0, 0], np.float32), (4, 1)))
        path = file.save(tmp_path / "a.glb")
        if weight:
            with pytest.raises(InputError, match="joints beyond the 2 of the skin"):
                read_mesh(path)
        else:
            read_mesh(path)


def test_positions_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    for value in (np.nan, np.inf, 1e20):
        file = two_joint_file()
        positions = np.full((4, 3), value, np.float32)
        file.gltf.meshes[0].primitives[0].attributes.POSITION = file.accessor(positions)
        with pytest.raises(InputError, match="not finite"):
            read_mesh(file.save(tmp_path / "a.glb"))


def test_shapes_without_names_are_numbered_and_two_of_one_name_are_refused(tmp_path: Path) -> None:
    file = two_joint_file()
    file.gltf.meshes[0].extras, file.gltf.meshes[0].name = {}, "face"
    assert read_mesh(file.save(tmp_path / "a.glb"))[2] == ("face0",)
    primitive = file.gltf.meshes[0].primitives[0]
    primitive.targets = primitive.targets * 2
    file.gltf.meshes[0].extras = {"targetNames": ["a", "a"]}
    with pytest.raises(InputError, match="2 blend shapes of 1 names"):
        read_mesh(file.save(tmp_path / "a.glb"))


def test_names_of_shapes_are_found_on_the_primitive_too(tmp_path: Path) -> None:
    whole = two_joint_file().save(tmp_path / "a.glb").read_bytes()

    def move_names(document: Any) -> None:
        mesh = document["meshes"][0]
        mesh["primitives"][0]["extras"] = mesh.pop("extras")

    (tmp_path / "a.glb").write_bytes(rewrite_json(whole, move_names))
    assert read_mesh(tmp_path / "a.glb")[2] == ("mouthOpen",)
