"""VRM 0 and 1 written by pygltflib: bones, expressions and licence come out the same."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from retarget.errors import InputError
from retarget.rig.glb import read_glb
from retarget.rig.vrm import Vrm, read_vrm
from tests.rig.glb_files import rewrite_json
from tests.rig.vrm_files import HUMANOID, PRESETS, bare, nodes_by_name, vrm0, vrm1

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def read(path: Path) -> Vrm:
    vrm = read_vrm(read_glb(path))
    assert vrm is not None
    return vrm


@pytest.mark.parametrize(("write", "version"), [(vrm0, 0), (vrm1, 1)])
def test_both_versions_say_the_same(write: Callable[[Path], Path], version: int, tmp_path: Path) -> None:
    vrm = read(write(tmp_path / "a.vrm"))
    nodes = nodes_by_name()
    assert vrm.version == version
    assert vrm.bones == {
        "neck": nodes["neck"],
        "head": nodes["head"],
        "jaw": nodes["jaw"],
        "eye_left": nodes[HUMANOID["leftEye"]],
        "eye_right": nodes[HUMANOID["rightEye"]],
    }
    shapes = read_glb(tmp_path / "a.vrm").document.tables("meshes")[0].table("extras").texts("targetNames")
    for name, parts in PRESETS.items():
        found = {shapes[bind.target].removeprefix("Fcl_"): bind.weight for bind in vrm.expressions[name]}
        assert found == pytest.approx(parts)


def test_the_licence_comes_along(tmp_path: Path) -> None:
    assert read(vrm0(tmp_path / "a.vrm")).licence == {"title": "Nova 0", "author": "nobody", "name": "CC0"}
    assert read(vrm1(tmp_path / "b.vrm")).licence["author"] == "nobody, else"


def test_expressions_of_unknown_preset_keep_their_name(tmp_path: Path) -> None:
    vrm = read(vrm0(tmp_path / "a.vrm", {"BrowInnerUp": {"browInnerUp": 1.0}}))
    assert "BrowInnerUp" in vrm.expressions


def test_a_plain_glb_has_none(tmp_path: Path) -> None:
    assert read_vrm(read_glb(bare(tmp_path / "a.glb"))) is None


DAMAGE: list[tuple[str, Callable[[dict[str, Any]], Any]]] = [
    ("humanBones", lambda vrm: vrm["humanoid"].update(humanBones=3)),
    ("nodes", lambda vrm: vrm["humanoid"]["humanBones"][0].update(node=9999)),
    ("mesh", lambda vrm: vrm["blendShapeMaster"]["blendShapeGroups"][0]["binds"][0].update(mesh="x")),
    ("meshes", lambda vrm: vrm["blendShapeMaster"]["blendShapeGroups"][0]["binds"][0].update(mesh=7)),
    ("index", lambda vrm: vrm["blendShapeMaster"]["blendShapeGroups"][0]["binds"][0].update(index=-1)),
    ("weight", lambda vrm: vrm["blendShapeMaster"]["blendShapeGroups"][0]["binds"][0].update(weight=None)),
    ("humanoid", lambda vrm: vrm.update(humanoid=[])),
]


@pytest.mark.parametrize(("word", "damage"), DAMAGE, ids=[word for word, _ in DAMAGE])
def test_a_damaged_extension_is_told_with_its_place(word: str, damage: Callable[..., Any], tmp_path: Path) -> None:
    path = vrm0(tmp_path / "a.vrm")
    path.write_bytes(rewrite_json(path.read_bytes(), lambda d: damage(d["extensions"]["VRM"]) and None))
    with pytest.raises(InputError, match=word):
        read_vrm(read_glb(path))
