"""Models of others become rigs: what was found is right where the truth is known, what was not is told."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError, OutputError
from retarget.frames import MarkerFrame
from retarget.rig.adopt import adopt
from retarget.rig.drive import Drive
from retarget.rig.fit import performer_from_neutral
from retarget.rig.glb import COMPRESSION
from retarget.rig.load import load_rig
from retarget.rig.names import ARKIT, letters
from retarget.rig.skinning import Skin
from tests.rig.glb_files import TRIANGLE, GlbFile, rewrite_json
from tests.rig.tubes import make_pose
from tests.rig.vrm_files import PRESETS, bare, model, saved, turned_back, vrm0, vrm1
from tests.synthetic.face import ALL_SITES, face_layout

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from retarget.rig.model import Rig


def shown(rig: Rig, shape: str | None = None) -> NDArray[np.float64]:
    """(V, 3) the skin's vertices at rest, or with one shape."""
    pose = make_pose(rig)
    if shape:
        pose = replace(pose, weights=np.eye(len(rig.shape_names))[rig.shape_names.index(shape)])
    return Skin(rig)(pose).positions[0].astype(float)


def place(rig: Rig, site: str) -> NDArray[np.float64]:
    return np.asarray(rig.joints.T_rig_joint[rig.sites[site].joint, :3, 3])


@pytest.mark.parametrize("write", [vrm0, vrm1])
def test_a_vrm_stands_and_speaks_like_the_model_that_it_was_made_from(
    write: Callable[[Path], Path], tmp_path: Path
) -> None:
    adoption = adopt(write(tmp_path / "a.vrm"), tmp_path / "rigs")
    rig, nova = load_rig(str(adoption.folder)), load_rig("nova")
    np.testing.assert_allclose(shown(rig), shown(nova), atol=1e-6)
    mouth = shown(nova) + 0.7 * (shown(nova, "jawOpen") - shown(nova))
    np.testing.assert_allclose(shown(rig, "jawOpen"), mouth, atol=1e-6)
    assert {"jawOpen", "mouthPucker", "mouthFunnel"} <= set(adoption.approximate)
    assert "Fcl_cheekPuff" in adoption.unmapped
    assert rig.jaw is not None
    assert rig.joints.names[rig.head_joint] == "J_Bip_C_Head"


def test_a_vrm_0_looks_along_minus_z_and_is_turned(tmp_path: Path) -> None:
    rig = load_rig(str(adopt(vrm0(tmp_path / "a.vrm"), tmp_path / "rigs").folder))
    assert rig.eye_joints[0] is not None
    assert rig.eye_joints[1] is not None
    assert rig.joints.T_rig_joint[rig.eye_joints[0], 0, 3] > rig.joints.T_rig_joint[rig.eye_joints[1], 0, 3]
    head = rig.joints.T_rig_joint[rig.head_joint, 2, 3]
    assert rig.joints.T_rig_joint[rig.eye_joints[0], 2, 3] > head


def test_a_glb_that_looks_back_is_told_by_its_eyes(tmp_path: Path) -> None:
    file = model()
    turned_back(file)
    rig = load_rig(str(adopt(saved(file, tmp_path / "a.glb"), tmp_path / "rigs").folder))
    np.testing.assert_allclose(shown(rig), shown(load_rig("nova")), atol=1e-6)


def test_perfect_sync_comes_before_the_presets(tmp_path: Path) -> None:
    extra = {"JawOpen": {"jawOpen": 1.0}, "BrowInnerUp": {"browInnerUp": 1.0}}
    adoption = adopt(vrm0(tmp_path / "a.vrm", extra), tmp_path / "rigs")
    assert adoption.shapes["jawOpen"] == {"Fcl_jawOpen": 1.0}
    assert "jawOpen" not in adoption.approximate
    assert adoption.shapes["browInnerUp"] == {"Fcl_browInnerUp": 1.0}


def test_shares_of_an_expression_are_kept(tmp_path: Path) -> None:
    adoption = adopt(vrm1(tmp_path / "a.vrm"), tmp_path / "rigs")
    theirs = {name.removeprefix("Fcl_"): share for name, share in adoption.shapes["mouthFunnel"].items()}
    assert theirs == pytest.approx(PRESETS["oh"])


def test_joints_of_the_face_are_found_by_where_they_stand(tmp_path: Path) -> None:
    adoption = adopt(saved(model(), tmp_path / "a.glb"), tmp_path / "rigs")
    rig, nova = load_rig(str(adoption.folder)), load_rig("nova")
    assert adoption.site_joints >= 38
    right = [np.linalg.norm(place(rig, site) - place(nova, site)) < 1e-6 for site in nova.sites if site in rig.sites]
    assert np.mean(right) > 0.85


@pytest.mark.parametrize("name", [str, letters, lambda n: f"Head.{n[:1].upper()}{n[1:]}"])
def test_bare_blend_shapes_get_sites_near_the_true_ones(name: Callable[[str], str], tmp_path: Path) -> None:
    adoption = adopt(bare(tmp_path / "a.glb", name), tmp_path / "rigs", "bare")
    rig, nova = load_rig(str(adoption.folder)), load_rig("nova")
    assert set(rig.shape_names) == set(ARKIT)
    assert (adoption.site_joints, adoption.site_places) == (0, 41)
    apart_mm = [1e3 * np.linalg.norm(place(rig, site) - place(nova, site)) for site in nova.sites]
    assert np.median(apart_mm) < 3
    assert max(apart_mm) < 10


def test_a_mesh_without_skin_turns_with_the_head_as_a_whole(tmp_path: Path) -> None:
    rig = load_rig(str(adopt(bare(tmp_path / "a.glb"), tmp_path / "rigs").folder))
    pose = make_pose(rig)
    rotations = pose.rotations.copy()
    rotations[rig.head_joint] = [0, 1, 0, 0]
    turned = Skin(rig)(replace(pose, rotations=rotations)).positions
    pivot = rig.joints.T_rig_joint[rig.head_joint, :3, 3]
    for surface, positions in zip(rig.surfaces, turned, strict=True):
        np.testing.assert_allclose(positions - pivot, (surface.positions - pivot) * [-1, 1, -1], atol=1e-6)


def test_a_rig_without_site_joints_is_driven_by_its_shapes_and_refuses_the_joints(tmp_path: Path) -> None:
    rig = load_rig(str(adopt(bare(tmp_path / "a.glb"), tmp_path / "rigs").folder))
    layout = face_layout("all", ALL_SITES)
    neutral = np.array([rig.sites[s].rest if s in rig.sites else [np.nan] * 3 for s in layout.sites])
    performer, T_world_head = performer_from_neutral(layout, neutral, rig)
    with pytest.raises(InputError, match=r"no joints at its sites; drive its blend shapes: --drive shapes"):
        Drive(rig, layout, performer)
    drive = Drive(rig, layout, performer, T_world_head, mode="shapes")
    smile = [f"mouthSmile{side}" for side in ("Left", "Right")]
    positions = performer.neutral.copy()
    skin = rig.surfaces[0]
    for m, site in enumerate(layout.sites):
        if site in rig.sites:
            vertex = int(np.argmin(np.linalg.norm(skin.positions - place(rig, site), axis=1)))
            for shape in (skin.shapes[rig.shape_names.index(name)] for name in smile):
                positions[m] += shape.offsets[shape.vertices == vertex].sum(axis=0)
    weights = np.zeros(0)
    for number in range(60):
        frame = MarkerFrame(number, number / 60, number / 60, layout, positions, T_world_head=T_world_head)
        weights = drive(frame).weights
    found = dict(zip(rig.shape_names, weights, strict=True))
    assert min(found[name] for name in smile) > 0.7
    assert max(share for name, share in found.items() if name not in smile) < 0.35


def test_nothing_is_left_behind_where_a_model_is_refused(tmp_path: Path) -> None:
    file = GlbFile()
    file.node(name="head", mesh=file.mesh(np.eye(3, dtype=np.float32), TRIANGLE))
    path = file.save(tmp_path / "a.glb")
    with pytest.raises(InputError, match="no skin and no blend shapes"):
        adopt(path, tmp_path / "rigs")
    assert list((tmp_path / "rigs").iterdir()) == []


@pytest.mark.parametrize("extension", COMPRESSION)
def test_compressed_models_are_refused_with_what_to_do(extension: str, tmp_path: Path) -> None:
    path = bare(tmp_path / "a.glb")
    path.write_bytes(rewrite_json(path.read_bytes(), lambda d: d | {"extensionsRequired": [extension]}))
    with pytest.raises(InputError, match=rf"{extension}.*export it again uncompressed"):
        adopt(path, tmp_path / "rigs")


def test_what_is_no_model_is_told(tmp_path: Path) -> None:
    (tmp_path / "face.fbx").write_text("x")
    for path in (tmp_path / "face.fbx", tmp_path / "nowhere.glb"):
        with pytest.raises(InputError, match=r"give a \.glb or \.vrm file"):
            adopt(path, tmp_path / "rigs")


def test_a_name_is_taken_once(tmp_path: Path) -> None:
    path = bare(tmp_path / "My face!.glb")
    assert adopt(path, tmp_path / "rigs").name == "My-face"
    with pytest.raises(OutputError, match="'My-face' already"):
        adopt(path, tmp_path / "rigs")
    with pytest.raises(OutputError, match="'human' already"):
        adopt(path, tmp_path / "rigs", "human")
    with pytest.raises(InputError, match="no name"):
        adopt(path, tmp_path / "rigs", "../..")


def test_the_rig_toml_can_be_edited_and_is_read_strictly(tmp_path: Path) -> None:
    folder = adopt(bare(tmp_path / "a.glb"), tmp_path / "rigs").folder
    text = (folder / "rig.toml").read_text()
    for old, new, part in (
        ('jawOpen = "jawOpen"', 'jawOpen = "jawOpn"', "did you mean 'jawOpen'"),
        ('jawOpen = "jawOpen"', "jawOpen = { jawOpen = 9 }", "shares between"),
        ('faces = "+z"', 'faces = "up"', "must be one of +z, -z"),
        ("noseTip = [", "noseTip = [1, ", "must be three numbers"),
    ):
        assert old in text
        (folder / "rig.toml").write_text(text.replace(old, new, 1))
        with pytest.raises(InputError) as caught:
            load_rig(str(folder))
        assert part in str(caught.value)
    (folder / "rig.toml").write_text(text.replace('jawOpen = "jawOpen"', "jawOpen = { jawOpen = 0.5 }", 1))
    rig, nova = load_rig(str(folder)), load_rig("nova")
    np.testing.assert_allclose(
        shown(rig, "jawOpen") - shown(rig), (shown(nova, "jawOpen") - shown(nova)) / 2, atol=1e-6
    )
