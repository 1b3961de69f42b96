"""rig.toml read strictly, rigs found by name and by path, and the rig that ships."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import numpy as np
import pygltflib
import pytest

from retarget.errors import InputError
from retarget.rig.load import available_rigs, load_rig
from retarget.rig.skinning import Skin
from tests.rig.glb_files import GlbFile, two_joint_file
from tests.rig.tubes import make_pose

if TYPE_CHECKING:
    from pathlib import Path

RIG_TOML = """
version = 1
name = "square"
mesh = "square.glb"
[joints]
head = "head"
neck = "neck"
eye_left = "eyeLeft"
[jaw]
joint = "jaw"
axis = [2, 0, 0]
min_deg = -3
max_deg = 30
[sites]
noseTip = "noseTip"
chin = "chin"
mandibleLeft = "mandible"
[licence]
name = "CC0-1.0"
author = "nobody"
"""


def face_file() -> GlbFile:
    """Neck, head, jaw, eye, and a site on either side of the jaw; the square hangs on head and jaw."""
    file = two_joint_file()
    file.node(0, name="noseTip", translation=[0.0, 0.1, 0.2])
    file.node(1, name="chin", translation=[0.0, -0.1, 0.1])
    file.node(file.node(4, name="fixed"), name="mandible", translation=[0.1, 0.0, 0.0])
    file.node(0, name="eyeLeft", translation=[0.03, 0.2, 0.1])
    neck = file.node(name="neck", translation=[0.0, 0.2, 0.0])
    file.gltf.scenes[0].nodes.remove(0)
    file.gltf.nodes[neck].children.append(0)
    return file


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    face_file().save(tmp_path / "square.glb")
    (tmp_path / "rig.toml").write_text(RIG_TOML)
    return tmp_path


def refused(folder: Path, old: str, new: str) -> str:
    """The sentence with which rig.toml is refused once `old` in it is `new`."""
    assert old in RIG_TOML
    (folder / "rig.toml").write_text(RIG_TOML.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        load_rig(str(folder))
    return str(caught.value)


def test_everything_that_rig_toml_says_is_in_the_rig(folder: Path) -> None:
    rig = load_rig(str(folder))
    names = rig.joints.names
    assert rig.name == "square"
    assert rig.path == folder / "rig.toml"
    assert names[rig.head_joint] == "head"
    assert rig.neck_joint is not None
    assert names[rig.neck_joint] == "neck"
    assert rig.eye_joints == (names.index("eyeLeft"), None)
    assert rig.shape_names == ("mouthOpen",)
    assert rig.licence == {"name": "CC0-1.0", "author": "nobody"}
    assert names.index("neck") < names.index("head") < names.index("jaw") < names.index("chin")


def test_sites_and_jaw_are_placed_in_the_heads_frame(folder: Path) -> None:
    rig = load_rig(str(folder))
    assert list(rig.sites) == ["noseTip", "chin", "mandibleLeft"]
    np.testing.assert_allclose(rig.sites["noseTip"].rest, [0, 0.1, 0.2], atol=1e-7)
    np.testing.assert_allclose(rig.sites["chin"].rest, [0, -0.6, 0.1], atol=1e-7)
    assert not rig.sites["noseTip"].rides_jaw
    assert rig.sites["chin"].rides_jaw
    assert rig.sites["mandibleLeft"].rides_jaw
    assert rig.joints.names[rig.joints.parents[rig.sites["mandibleLeft"].joint]] == "chin"
    assert rig.jaw is not None
    np.testing.assert_allclose(rig.jaw.pivot, [0, -0.5, 0], atol=1e-7)
    np.testing.assert_array_equal(rig.jaw.axis, [1, 0, 0])
    np.testing.assert_allclose([rig.jaw.min_rad, rig.jaw.max_rad], np.radians([-3, 30]))


def test_a_rig_is_found_by_its_folder_its_file_and_its_mesh(folder: Path) -> None:
    for path in (folder, folder / "rig.toml", folder / "square.glb"):
        assert load_rig(str(path)).path == folder / "rig.toml"


def test_a_rig_without_jaw_sites_neck_and_licence_is_a_rig(folder: Path) -> None:
    (folder / "rig.toml").write_text('name = "square"\nmesh = "square.glb"\n[joints]\nhead = "head"\n')
    rig = load_rig(str(folder))
    assert (rig.jaw, rig.neck_joint, rig.eye_joints, rig.sites, rig.licence) == (None, None, (None, None), {}, {})


def test_an_unknown_rig_is_answered_with_those_that_ship_and_the_nearest() -> None:
    with pytest.raises(
        InputError, match=r"There is no rig 'humn' \(did you mean 'human'\?\)\. Name one that ships \(human"
    ):
        load_rig("humn")
    with pytest.raises(InputError, match=r"There is no rig '/nowhere/x\.toml'\. Name one"):
        load_rig("/nowhere/x.toml")


def test_a_folder_without_rig_toml_is_no_rig(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a folder with a rig\.toml"):
        load_rig(str(tmp_path))


def test_a_sound_mesh_without_rig_toml_asks_for_one(tmp_path: Path) -> None:
    path = face_file().save(tmp_path / "square.glb")
    with pytest.raises(InputError, match=r"can be read, but a rig\.toml beside it must say"):
        load_rig(str(path))


def test_a_mesh_that_is_cut_short_or_has_no_skin_is_told_even_without_rig_toml(tmp_path: Path) -> None:
    path = face_file().save(tmp_path / "square.glb")
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(InputError, match="cut short"):
        load_rig(str(path))
    file = GlbFile()
    file.node(mesh=file.mesh(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.uint8)))
    with pytest.raises(InputError, match="has no skin"):
        load_rig(str(file.save(path)))


@pytest.mark.parametrize(
    ("old", "new", "place", "advice"),
    [
        ("eye_left", "eyeleft", "'eyeleft' in [joints] on line 8", "did you mean 'eye_left'?"),
        ("max_deg", "max_dg", "'max_dg' in [jaw] on line 13", "did you mean 'max_deg'?"),
        ("[sites]", "[site]", "'site'", "did you mean 'sites'?"),
    ],
)
def test_a_misspelt_key_is_refused_with_its_place_and_the_nearest(
    old: str, new: str, place: str, advice: str, folder: Path
) -> None:
    message = refused(folder, old, new)
    assert place in message
    assert advice in message


def test_a_joint_that_the_mesh_lacks_is_refused_with_its_place_and_the_nearest(folder: Path) -> None:
    message = refused(folder, '= "noseTip"', '= "noseTop"')
    assert "'noseTip' in [sites] on line 15 names the joint 'noseTop', which square.glb does not have" in message
    assert "did you mean 'noseTip'?" in message
    assert "'head' in [joints]" in refused(folder, '"head"', '"skull"')
    assert "'joint' in [jaw]" in refused(folder, '"jaw"', '"maxilla"')


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        ("version = 1", "version = 2", "must be 1"),
        ('name = "square"', "", "'name' is missing"),
        ('mesh = "square.glb"', "", "'mesh' is missing"),
        ('head = "head"', "", "'head' in [joints] is missing"),
        ("[2, 0, 0]", "[0, 0, 0]", "must point somewhere"),
        ("[2, 0, 0]", "[2, 0]", "must be three numbers"),
        ("[2, 0, 0]", "[nan, 0, 0]", "must be three numbers"),
        ("min_deg = -3", "min_deg = 5", "must enclose 0"),
        ("max_deg = 30", "max_deg = 300", "within 90"),
        ("max_deg = 30", "", "'max_deg' in [jaw] is missing"),
        ("max_deg = 30", 'max_deg = "30"', "must be a number"),
        ('chin = "chin"', 'chin = "noseTip"', "must have a joint of its own; 'noseTip' is that of 'noseTip' already"),
        ('author = "nobody"', "year = 2020", "must be a text"),
        ("[joints]", "[joints", "is not a TOML text"),
        ('mesh = "square.glb"', 'mesh = "round.glb"', "cannot be read"),
        ('mesh = "square.glb"', 'mesh = "."', "cannot be read"),
    ],
)
def test_what_is_wrong_in_rig_toml_is_said_in_one_sentence(old: str, new: str, part: str, folder: Path) -> None:
    message = refused(folder, old, new)
    assert part in message
    assert "\n" not in message


def test_the_rigs_that_ship_are_listed_with_what_they_hold() -> None:
    summaries = {rig.name: rig for rig in available_rigs()}
    human = summaries["human"]
    rig = load_rig("human")
    assert human.path == rig.path
    assert (human.joints, human.sites, human.shapes) == (len(rig.joints.names), len(rig.sites), len(rig.shape_names))
    assert human.vertices == sum(len(s.positions) for s in rig.surfaces)
    assert human.licence.startswith("CC0")


def test_the_human_rig_stands_at_rest_as_an_independent_reader_finds_it() -> None:
    rig = load_rig("human")
    gltf = pygltflib.GLTF2().load(str(rig.path.parent / "human.glb"))
    blob = gltf.binary_blob()
    primitives = [p for mesh in gltf.meshes for p in mesh.primitives]
    assert len(primitives) == len(rig.surfaces)
    deformed = Skin(rig)(make_pose(rig))
    for primitive, positions in zip(primitives, deformed.positions, strict=True):
        accessor = gltf.accessors[primitive.attributes.POSITION]
        start = gltf.bufferViews[accessor.bufferView].byteOffset + (accessor.byteOffset or 0)
        assert accessor.componentType == 5126
        assert not gltf.bufferViews[accessor.bufferView].byteStride
        expected = np.frombuffer(blob, "<f4", 3 * accessor.count, start).reshape(-1, 3)
        np.testing.assert_allclose(positions, expected, atol=1e-6)


def test_the_human_rig_can_be_posed_both_ways() -> None:
    rig = load_rig("human")
    linear, dual = (Skin(rig, method)(make_pose(rig)) for method in ("linear", "dual-quaternion"))
    for a, b in zip(linear.positions, dual.positions, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)
    for surface, normals in zip(rig.surfaces, linear.normals, strict=True):
        assert (surface.normals * normals).sum(axis=1).min() > 0.9


def test_importing_the_loader_and_skinning_loads_no_heavy_library() -> None:
    code = (
        "import sys, retarget.rig.load, retarget.rig.skinning; print([m for m in ('scipy', 'PIL') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
