"""Somebody's model becomes a rig: a GLB, a VRM or a folder of OBJ shapes to a folder with the GLB and a rig.toml.

Head, neck, jaw and eyes are found by the VRM's humanoid or by name, blend shapes by the names of all schemes
(`retarget.rig.names`), a VRM's own expressions first. A joint of the face drives the site that it is named after or
stands at; other sites become places on the mesh, at which blend shapes can be told from markers. The mesh itself is
copied as it is; what was decided stands in the rig.toml, to be edited.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from retarget.errors import InputError, OutputError
from retarget.rig.glb import read_glb
from retarget.rig.library import RIG_FILE, shipped_rigs
from retarget.rig.load import load_rig
from retarget.rig.names import ARKIT, arkit_name, bone_roles, nearest_arkit, site_name
from retarget.rig.nodes import read_nodes
from retarget.rig.obj_folder import read_obj_folder
from retarget.rig.rig_toml import Plan, rig_toml
from retarget.rig.site_places import carried_sites, nearest_joints, on_the_mesh
from retarget.rig.surfaces import target_names
from retarget.rig.vrm import read_vrm
from retarget.rig.write_glb import glb_bytes

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from retarget.rig.fields import Fields
    from retarget.rig.glb import Glb
    from retarget.rig.model import Rig
    from retarget.rig.nodes import Nodes
    from retarget.rig.vrm import Vrm

MODEL_RIG = "human"
"""Whose sites are carried over."""
ENDINGS = (".glb", ".vrm")
Shapes = dict[str, dict[str, float]]
"""Our name to shares of theirs."""


@dataclass(frozen=True, slots=True)
class Adoption:
    """What has become of a model."""

    name: str
    folder: Path
    joints: Mapping[str, str]
    """Role to joint."""
    shapes: Mapping[str, Mapping[str, float]]
    """ARKit's name to shares of the model's blend shapes."""
    approximate: tuple[str, ...]
    """Those of `shapes` that are only the nearest."""
    unmapped: tuple[str, ...]
    """The model's blend shapes that no shape of ours stands for."""
    missing: tuple[str, ...]
    """ARKit shapes that the model does not have."""
    site_joints: int
    site_places: int
    notes: tuple[str, ...] = field(default=())
    """Sentences on what may need the user's eye."""


def adopt(path: Path, target_folder: Path, name: str | None = None) -> Adoption:
    """Make a rig called `name` (by default after the file) out of the model at `path`, in `target_folder`/`name`.

    InputError where the model cannot be read or nothing in it would move; OutputError where there is such a rig already
    or the folder cannot be written. Nothing is left behind then.
    """
    name = _checked_name(name or path.stem)
    folder = target_folder / name
    if folder.exists() or name in shipped_rigs():
        raise OutputError(f"There is a rig {name!r} already; give another name with --name, or remove {folder}.")
    try:
        target_folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target_folder, prefix=".adding-") as made:
            draft = Path(made) / name
            draft.mkdir()
            adoption = _adopt(path, draft, name, folder)
            draft.rename(folder)
    except OSError as error:
        raise OutputError(f"The rig cannot be written to {folder}: {error.strerror or error}.") from error
    return adoption


def _checked_name(name: str) -> str:
    cleaned = re.sub(r"[^\w.-]+", "-", name).strip("-.")
    if not cleaned:
        raise InputError(f"{name!r} is no name for a rig; give one of letters and digits with --name.")
    return cleaned


def _adopt(path: Path, draft: Path, name: str, folder: Path) -> Adoption:
    mesh = draft / f"{name}.glb"
    if path.is_dir():
        mesh.write_bytes(glb_bytes(read_obj_folder(path)))
    elif path.suffix.lower() in ENDINGS and path.is_file():
        read_glb(path)
        shutil.copyfile(path, mesh)
    else:
        raise InputError(f"{path} is no model: give a .glb or .vrm file, or a folder of OBJ files.")
    plan, shape_names, notes = _plan(mesh, name)
    _write(draft, plan)
    rig = load_rig(str(draft))  # what is wrong with the mesh is told here
    _place_sites(plan, rig)
    _write(draft, plan)
    rig = load_rig(str(draft))
    if not rig.sites:
        notes.append("No sites could be found, so markers cannot drive it; add them to [sites].")
    used = {theirs for parts in plan.shapes.values() for theirs in parts}
    return Adoption(
        name=name,
        folder=folder,
        joints=plan.joints,
        shapes=plan.shapes,
        approximate=tuple(plan.approximate),
        unmapped=tuple(s for s in shape_names if s not in used),
        missing=tuple(s for s in ARKIT if s not in plan.shapes),
        site_joints=len(plan.site_joints),
        site_places=len(plan.site_places),
        notes=tuple(notes),
    )


def _write(draft: Path, plan: Plan) -> None:
    (draft / RIG_FILE).write_text(rig_toml(plan), "utf-8")


def _plan(mesh: Path, name: str) -> tuple[Plan, tuple[str, ...], list[str]]:
    """All but the sites; the mesh's blend shapes; what to tell the user."""
    glb = read_glb(mesh)
    vrm, nodes = read_vrm(glb), read_nodes(glb)
    joints, notes = _joints(glb, vrm, nodes)
    shape_names = tuple(dict.fromkeys(n for names in _target_names(glb) for n in names))
    shapes, approximate = _shapes(_expressions(glb, vrm), shape_names)
    if shape_names and not shapes:
        notes.append("None of its blend shapes has a known name; write those to use into [shapes].")
    faces = "-z" if _looks_back(vrm, joints, nodes) else "+z"
    plan = Plan(name, mesh.name, faces, joints, shapes, approximate, licence=_licence(glb, vrm))
    return plan, shape_names, notes


def _joints(glb: Glb, vrm: Vrm | None, nodes: Nodes) -> tuple[dict[str, str], list[str]]:
    listed = {n for skin in glb.document.tables("skins") for n in skin.integers("joints")}
    candidates = [n for n in nodes.order if n in listed] or list(nodes.order)
    joints = bone_roles(nodes.names[n] for n in candidates)
    if vrm:
        joints |= {role: nodes.names[n] for role, n in vrm.bones.items() if n in nodes.order}
    if not listed:
        return _joints_without_skin(glb, joints, nodes)
    if "head" in joints:
        return joints, []
    root = nodes.names[candidates[0]]
    return {"head": root} | joints, [f"No joint is named as a head; {root!r} is taken for it."]


def _joints_without_skin(glb: Glb, joints: dict[str, str], nodes: Nodes) -> tuple[dict[str, str], list[str]]:
    """Bones move nothing but what hangs on them, so the head is what carries the mesh."""
    carrying = [n for n in nodes.order if "mesh" in glb.entry("nodes", n)]
    if not carrying:
        raise InputError(f"{glb.path.name} shows no mesh, so there is nothing to move; export the scene with its mesh.")
    line = [carrying[0]]
    while nodes.parents[line[-1]] >= 0:
        line.append(nodes.parents[line[-1]])
    above = [nodes.names[n] for n in line]
    if joints.get("head") in above:
        return joints, []
    eyes = {role: joint for role, joint in joints.items() if role.startswith("eye")}
    return {"head": above[-1]} | eyes, [f"Without a skin the whole model turns with the head, by {above[-1]!r}."]


def _looks_back(vrm: Vrm | None, joints: Mapping[str, str], nodes: Nodes) -> bool:
    """True where the character looks along -Z: every VRM 0, or one with the left eye on the right."""
    if vrm:
        return vrm.version == 0
    if "eye_left" not in joints or "eye_right" not in joints:
        return False
    left, right = (nodes.T_rig_node[nodes.names.index(joints[role]), 0, 3] for role in ("eye_left", "eye_right"))
    return bool(left < right)


def _target_names(glb: Glb) -> list[list[str]]:
    """Of every mesh, as the loader names them."""
    return [target_names(mesh) for mesh in glb.document.tables("meshes")]


def _expressions(glb: Glb, vrm: Vrm | None) -> Shapes:
    """A VRM's expressions as shares of the mesh's shapes."""
    names = _target_names(glb)
    found: Shapes = {}
    for expression, binds in (vrm.expressions if vrm else {}).items():
        parts = {names[b.mesh][b.target]: b.weight for b in binds if b.target < len(names[b.mesh]) and b.weight > 0}
        if parts:
            found[expression] = parts
    return found


def _shapes(expressions: Shapes, theirs: Iterable[str]) -> tuple[Shapes, list[str]]:
    """ARKit's names to shares of theirs, exact names before the nearest ones; and which are only the nearest."""
    own: Shapes = {name: {name: 1.0} for name in theirs}
    found: Shapes = {}
    for source in (expressions, own):
        exact: Shapes = {}
        for name, parts in source.items():
            ours = arkit_name(name)
            if ours and ours not in found:
                exact.setdefault(ours, {}).update(parts)
        found |= exact
    approximate = []
    for source in (expressions, own):
        for name, parts in source.items():
            nearest = nearest_arkit(name)
            if nearest and nearest not in found:
                found[nearest] = parts
                if not nearest.startswith("eyeBlink"):
                    approximate.append(nearest)
    return {name: found[name] for name in ARKIT if name in found}, approximate


def _place_sites(plan: Plan, rig: Rig) -> None:
    """Fill in the plan's sites from the rig as it is without them."""
    model = load_rig(MODEL_RIG)
    taken = {rig.head_joint, rig.neck_joint, *rig.eye_joints, rig.jaw.joint if rig.jaw else None}
    by_name: dict[str, str] = {}
    for j, joint in enumerate(rig.joints.names):
        site = site_name(joint, model.sites)
        if site and j not in taken:
            by_name.setdefault(site, joint)
    places = carried_sites(model, rig)
    used = {rig.joints.index(joint) for joint in by_name.values()}
    left = {site: place for site, place in places.items() if site not in by_name}
    by_place = nearest_joints(rig, left, used | {j for j in taken if j is not None})
    plan.site_joints.update(by_name | {site: rig.joints.names[j] for site, j in by_place.items()})
    rest = {site: place for site, place in left.items() if site not in by_place}
    if rest and rig.shape_names:
        plan.site_places.update(on_the_mesh(rest, rig.surfaces))


def _licence(glb: Glb, vrm: Vrm | None) -> dict[str, str]:
    asset: Fields = glb.document.table("asset")
    texts = {key: asset.data.get(key) for key in ("copyright", "generator")}
    found = {key: value for key, value in texts.items() if isinstance(value, str) and value}
    return found | dict(vrm.licence if vrm else {})
