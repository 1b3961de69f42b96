"""The stylised rig as others would write it: under VRoid's names, as VRM 0 or 1, or as bare blend shapes.

pygltflib does the writing, so that nothing of the package's own reader or writer is in the files.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pygltflib as g

if TYPE_CHECKING:
    from collections.abc import Callable

NOVA = Path(__file__).parents[2] / "rigs" / "nova" / "nova.glb"
VROID = {
    "neck": "J_Bip_C_Neck",
    "head": "J_Bip_C_Head",
    "jaw": "J_Bip_C_Jaw",
    "eyeLeft": "J_Adj_L_FaceEye",
    "eyeRight": "J_Adj_R_FaceEye",
}
HUMANOID = {"neck": "neck", "head": "head", "jaw": "jaw", "leftEye": "eyeLeft", "rightEye": "eyeRight"}
PRESETS = {
    "aa": {"jawOpen": 0.7},
    "ou": {"mouthPucker": 1.0},
    "oh": {"mouthFunnel": 0.8, "jawOpen": 0.2},
    "blinkLeft": {"eyeBlinkLeft": 1.0},
    "blinkRight": {"eyeBlinkRight": 1.0},
    "happy": {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0},
}
"""VRM 1's names of expressions, by shares of the mesh's shapes."""
VRM0_NAMES = {"aa": "a", "ou": "u", "oh": "o", "blinkLeft": "blink_l", "blinkRight": "blink_r", "happy": "joy"}


def model(shape_name: Callable[[str], str] = str) -> g.GLTF2:
    """Nova with VRoid's names of the main joints and meaningless ones of the others."""
    file = g.GLTF2().load(str(NOVA))
    file.meshes[0].extras["targetNames"] = [shape_name(n) for n in file.meshes[0].extras["targetNames"]]
    for number, node in enumerate(file.nodes):
        node.name = VROID.get(node.name, f"J_Sec_{number:03}")
    return file


def nodes_by_name() -> dict[str, int]:
    return {node.name: n for n, node in enumerate(g.GLTF2().load(str(NOVA)).nodes)}


def turned_back(file: g.GLTF2) -> None:
    """The whole scene below a root that is turned half round, so that the character looks along -Z."""
    scene = file.scenes[0]
    file.nodes.append(g.Node(name="Root", rotation=[0.0, 1.0, 0.0, 0.0], children=list(scene.nodes)))
    scene.nodes = [len(file.nodes) - 1]


def vrm0(path: Path, extra: dict[str, dict[str, float]] | None = None) -> Path:
    """Looks along -Z; `extra` are expressions of unknown preset, as Perfect Sync has them."""
    file, shapes, nodes = model(lambda name: f"Fcl_{name}"), _shape_numbers(), nodes_by_name()
    turned_back(file)
    groups = [_group(VRM0_NAMES[name], VRM0_NAMES[name], parts, shapes) for name, parts in PRESETS.items()]
    groups += [_group(name, "unknown", parts, shapes) for name, parts in (extra or {}).items()]
    bones = [{"bone": bone, "node": nodes[ours]} for bone, ours in HUMANOID.items()]
    file.extensions["VRM"] = {
        "humanoid": {"humanBones": [*bones, {"bone": "leftThumbDistal", "node": -1}]},
        "blendShapeMaster": {"blendShapeGroups": groups},
        "meta": {"title": "Nova 0", "author": "nobody", "licenseName": "CC0"},
    }
    return saved(file, path)


def vrm1(path: Path) -> Path:
    file, shapes, nodes = model(lambda name: f"Fcl_{name}"), _shape_numbers(), nodes_by_name()
    file.extensionsUsed = ["VRMC_vrm"]
    file.extensions["VRMC_vrm"] = {
        "specVersion": "1.0",
        "humanoid": {"humanBones": {bone: {"node": nodes[ours]} for bone, ours in HUMANOID.items()}},
        "expressions": {
            "preset": {name: {"morphTargetBinds": _binds_1(parts, shapes, nodes)} for name, parts in PRESETS.items()},
            "custom": {"BrowInnerUp": {"morphTargetBinds": _binds_1({"browInnerUp": 1.0}, shapes, nodes)}},
        },
        "meta": {"name": "Nova 1", "authors": ["nobody", "else"], "licenseUrl": "https://vrm.dev/licenses/1.0/"},
    }
    return saved(file, path)


def bare(path: Path, shape_name: Callable[[str], str] = str) -> Path:
    """No skin at all: blend shapes on a mesh."""
    file = model(shape_name)
    file.skins = []
    for node in file.nodes:
        node.skin = None
    for primitive in file.meshes[0].primitives:
        primitive.attributes.JOINTS_0 = primitive.attributes.WEIGHTS_0 = None
    return saved(file, path)


def saved(file: g.GLTF2, path: Path) -> Path:
    file.save_binary(str(path))
    return path


def _shape_numbers() -> dict[str, int]:
    names = g.GLTF2().load(str(NOVA)).meshes[0].extras["targetNames"]
    return {name: number for number, name in enumerate(names)}


def _group(name: str, preset: str, parts: dict[str, float], shapes: dict[str, int]) -> dict[str, Any]:
    binds = [{"mesh": 0, "index": shapes[shape], "weight": 100 * share} for shape, share in parts.items()]
    return {"name": name, "presetName": preset, "binds": binds}


def _binds_1(parts: dict[str, float], shapes: dict[str, int], nodes: dict[str, int]) -> list[dict[str, Any]]:
    return [{"node": nodes["nova"], "index": shapes[shape], "weight": share} for shape, share in parts.items()]
