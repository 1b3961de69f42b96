"""What VRM adds to a GLB: the humanoid's bones, the expressions and the licence; both versions as one value.

VRM 0 keeps all in the extension ``VRM`` and looks along -Z; VRM 1 in ``VRMC_vrm``, looks along +Z as glTF does, and has
other names for the presets (`retarget.rig.names`). Expressions that change materials alone have no binds here.
References: github.com/vrm-c/vrm-specification, 0.0 schema and VRMC_vrm-1.0.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from retarget.rig.names import vrm1_name

if TYPE_CHECKING:
    from collections.abc import Mapping

    from retarget.rig.fields import Fields
    from retarget.rig.glb import Glb

ROLES = {"head": "head", "neck": "neck", "jaw": "jaw", "leftEye": "eye_left", "rightEye": "eye_right"}
"""Names of humanoid bones, which are the same in both versions, to roles in a rig."""
_TEXTS_0 = {
    "title": "title",
    "author": "author",
    "licenseName": "name",
    "otherLicenseUrl": "url",
    "reference": "source",
}
_TEXTS_1 = {"name": "title", "licenseUrl": "url", "copyrightInformation": "copyright"}


@dataclass(frozen=True, slots=True)
class Bind:
    """A part of an expression: one morph target of one mesh."""

    mesh: int
    target: int
    weight: float
    """In [0, 1]."""


@dataclass(frozen=True, slots=True)
class Vrm:
    """The extension of one file."""

    version: int
    bones: Mapping[str, int]
    """Role in a rig (`ROLES`) to node."""
    expressions: Mapping[str, tuple[Bind, ...]]
    """By VRM 1's names for presets, by their own for others."""
    licence: Mapping[str, str] = field(default_factory=dict)
    """Texts for a rig's [licence]."""


def read_vrm(glb: Glb) -> Vrm | None:
    """The extension; None where the file is a plain GLB. InputError where it is damaged."""
    extensions = glb.document.table("extensions")
    if "VRMC_vrm" in extensions:
        return _read_1(glb, extensions.table("VRMC_vrm"))
    if "VRM" in extensions:
        return _read_0(glb, extensions.table("VRM"))
    return None


def _read_0(glb: Glb, vrm: Fields) -> Vrm:
    bones = {}
    for bone in vrm.table("humanoid").tables("humanBones"):
        role = ROLES.get(bone.text("bone"))
        if role and bone.data.get("node") != -1:  # UniVRM writes -1 for a bone that is not there
            bones[role] = _node(glb, bone)
    expressions: dict[str, tuple[Bind, ...]] = {}
    for group in vrm.table("blendShapeMaster").tables("blendShapeGroups"):
        preset = group.text("presetName", "unknown")
        name = vrm1_name(preset) if preset not in ("", "unknown") else group.text("name", "")
        binds = tuple(_bind_0(glb, bind) for bind in group.tables("binds"))
        if name and binds:
            expressions.setdefault(name, binds)
    meta = vrm.table("meta")
    return Vrm(0, bones, expressions, _texts(meta, _TEXTS_0))


def _bind_0(glb: Glb, bind: Fields) -> Bind:
    mesh = bind.integer("mesh")
    glb.entry("meshes", mesh)
    return Bind(mesh, bind.integer("index"), _share(bind.number("weight", 100.0) / 100))


def _read_1(glb: Glb, vrm: Fields) -> Vrm:
    listed = vrm.table("humanoid").table("humanBones")
    bones = {role: _node(glb, listed.table(bone)) for bone, role in ROLES.items() if bone in listed}
    expressions: dict[str, tuple[Bind, ...]] = {}
    for kind in ("preset", "custom"):
        table = vrm.table("expressions").table(kind)
        for name in table.data:
            binds = tuple(_bind_1(glb, bind) for bind in table.table(name).tables("morphTargetBinds"))
            if binds:
                expressions.setdefault(name, binds)
    meta = vrm.table("meta")
    authors = ", ".join(meta.texts("authors"))
    return Vrm(1, bones, expressions, _texts(meta, _TEXTS_1) | ({"author": authors} if authors else {}))


def _bind_1(glb: Glb, bind: Fields) -> Bind:
    node = glb.entry("nodes", bind.integer("node"))
    return Bind(node.integer("mesh"), bind.integer("index"), _share(bind.number("weight", 1.0)))


def _node(glb: Glb, bone: Fields) -> int:
    node = bone.integer("node")
    glb.entry("nodes", node)
    return node


def _share(weight: float) -> float:
    return min(max(weight, 0.0), 1.0)


def _texts(meta: Fields, keys: Mapping[str, str]) -> dict[str, str]:
    values = {ours: meta.data.get(theirs) for theirs, ours in keys.items()}
    return {ours: value for ours, value in values.items() if isinstance(value, str) and value}
