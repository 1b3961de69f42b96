"""Rigs on disk: `rig.toml`, which says what the joints of a GLB mean, and the rigs that ship with the package.

rig.toml, version 1::

    name = "human"
    mesh = "human.glb"                 # beside this file
    [joints]                           # names of joints in the GLB; head must be there
    head = "head"
    neck = "neck"
    eye_left = "eyeLeft"
    eye_right = "eyeRight"
    [jaw]                              # a hinge through the joint's rest position; may be left out
    joint = "jaw"
    axis = [1, 0, 0]                   # frame head; a positive turn opens
    min_deg = -2
    max_deg = 35
    [sites]                            # site = joint that a marker there drives
    noseTip = "noseTip"
    [responses]                        # may be left out; see `retarget.rig.responses`
    jawOpen = { measure = "mouth_width", curve = "ramp", start = 0.02, end = 0.3 }
    [secondary]                        # joints that trail, may be left out; see `retarget.rig.secondary`
    pendantLeft = { alpha = 0.9 }
    [licence]                          # any texts: name, source, author, ...
    name = "CC0-1.0"
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from retarget.errors import InputError
from retarget.rig.glb import read_glb
from retarget.rig.model import Jaw, Rig, Site
from retarget.rig.nodes import read_nodes, read_skeleton
from retarget.rig.responses import read_responses
from retarget.rig.secondary import read_gains
from retarget.rig.surfaces import read_surfaces
from retarget.toml_table import read_table

if TYPE_CHECKING:
    from collections.abc import Collection

    from numpy.typing import NDArray

    from retarget.filters import PdGains
    from retarget.rig.model import Joints, Surface
    from retarget.toml_table import Table

    Array = NDArray[np.float64]

RIG_FILE = "rig.toml"


@dataclass(frozen=True, slots=True)
class RigSummary:
    """One line about a rig that ships with the package."""

    name: str
    path: Path
    """Its rig.toml."""
    joints: int
    sites: int
    shapes: int
    vertices: int
    licence: str
    """The name of its licence; empty where rig.toml gives none."""


def load_rig(name_or_path: str) -> Rig:
    """The rig that ships under this name, or that of a folder with a rig.toml, or of a rig.toml.

    Raises InputError where there is none, or where its files cannot be used.
    """
    return _read_rig(_find(name_or_path))


def available_rigs() -> tuple[RigSummary, ...]:
    """The rigs that ship with the package, by name; reads them all."""
    return tuple(_summary(path) for path in _shipped().values())


def _summary(path: Path) -> RigSummary:
    rig = _read_rig(path)
    return RigSummary(
        name=rig.name,
        path=path,
        joints=len(rig.joints.names),
        sites=len(rig.sites),
        shapes=len(rig.shape_names),
        vertices=sum(len(s.positions) for s in rig.surfaces),
        licence=rig.licence.get("name", ""),
    )


def _shipped() -> dict[str, Path]:
    """Name of the folder to its rig.toml."""
    import rigs

    return {path.parent.name: path for path in sorted(Path(rigs.__file__).parent.glob(f"*/{RIG_FILE}"))}


def _find(name_or_path: str) -> Path:
    """The rig.toml that is meant."""
    shipped = _shipped()
    if name_or_path in shipped:
        return shipped[name_or_path]
    path = Path(name_or_path)
    if path.is_dir():
        path /= RIG_FILE
    if path.suffix == ".toml" and path.is_file():
        return path
    if path.suffix == ".glb" and path.is_file():
        return _beside(path)
    raise InputError(
        f"There is no rig {name_or_path!r}{_near(name_or_path, shipped)}. Name one that ships ({', '.join(shipped)}), "
        f"a folder with a {RIG_FILE}, or such a file."
    )


def _beside(mesh: Path) -> Path:
    """The rig.toml in the folder of a GLB, once the GLB itself is known to be sound."""
    _read_mesh(mesh, ())
    path = mesh.parent / RIG_FILE
    if path.is_file() and read_table(path, "rig file").string("mesh") == mesh.name:
        return path
    raise InputError(
        f"{mesh} can be read, but a {RIG_FILE} beside it must say which of its joints are head, jaw and sites."
    )


def _read_rig(path: Path) -> Rig:
    root = read_table(path, "rig file")
    root.only("version", "name", "mesh", "joints", "jaw", "sites", "responses", "secondary", "licence")
    if root.values.get("version", 1) != 1:
        raise root.wrong("version", "must be 1, the only version there is")
    named = _named_joints(root)
    file = root.string("mesh")
    trailing = root.table("secondary").values
    mesh = _read_mesh(path.parent / file, {table.string(key) for table, key in named.values()} | set(trailing))
    joints = mesh.joints
    places = {what: _joint(mesh, table, key, file) for what, (table, key) in named.items()}
    origin = joints.T_rig_joint[places["head"], :3, 3]
    return Rig(
        name=root.string("name"),
        path=path,
        joints=joints,
        surfaces=mesh.surfaces,
        shape_names=mesh.shape_names,
        sites=_sites(root.table("sites"), joints, places, origin),
        head_joint=places["head"],
        neck_joint=places.get("neck"),
        eye_joints=(places.get("eye_left"), places.get("eye_right")),
        jaw=_jaw(root.table("jaw"), joints, places["jaw"], origin) if "jaw" in places else None,
        licence=_licence(root.table("licence")),
        responses=read_responses(root.table("responses"), mesh.shape_names),
        secondary=_secondary(root.table("secondary"), mesh, places),
    )


def _named_joints(root: Table) -> dict[str, tuple[Table, str]]:
    """What needs a joint (a role, or a site as ``sites.noseTip``) and where its name stands."""
    roles, jaw, sites = root.table("joints"), root.table("jaw"), root.table("sites")
    roles.only("head", "neck", "eye_left", "eye_right")
    roles.get("head")
    named = {role: (roles, role) for role in roles.values}
    if "jaw" in root.values:
        jaw.only("joint", "axis", "min_deg", "max_deg")
        named["jaw"] = (jaw, "joint")
    return named | {f"sites.{site}": (sites, site) for site in sites.values}


class _Mesh(NamedTuple):
    """What a GLB holds."""

    joints: Joints
    surfaces: tuple[Surface, ...]
    shape_names: tuple[str, ...]
    node_names: tuple[str, ...]
    """Of all nodes: what could be a joint."""


def _read_mesh(path: Path, named: Collection[str]) -> _Mesh:
    """The GLB at `path`; `named` nodes are joints even without a skin."""
    glb = read_glb(path)
    nodes = read_nodes(glb)
    skeleton = read_skeleton(glb, nodes, named)
    surfaces, shape_names = read_surfaces(glb, nodes, skeleton)
    return _Mesh(skeleton.joints(), surfaces, shape_names, nodes.names)


def _joint(mesh: _Mesh, table: Table, key: str, file: str) -> int:
    name = table.string(key)
    if name not in mesh.joints.names:
        raise table.wrong(key, f"names the joint {name!r}, which {file} does not have{_near(name, mesh.node_names)}")
    return mesh.joints.index(name)


def _sites(table: Table, joints: Joints, places: dict[str, int], origin: Array) -> dict[str, Site]:
    below_jaw = _below(joints, places["jaw"]) if "jaw" in places else frozenset()
    sites: dict[str, Site] = {}
    driven_by: dict[int, str] = {}
    for name in table.values:
        joint = places[f"sites.{name}"]
        if joint in driven_by:
            raise table.wrong(
                name, f"must have a joint of its own; {joints.names[joint]!r} is that of {driven_by[joint]!r} already"
            )
        driven_by[joint] = name
        sites[name] = Site(name, joint, rides_jaw=joint in below_jaw, rest=joints.T_rig_joint[joint, :3, 3] - origin)
    return sites


def _jaw(table: Table, joints: Joints, joint: int, origin: Array) -> Jaw:
    axis = table.array("axis", (3,))
    length = float(np.linalg.norm(axis))
    if length < 1e-6:
        raise table.wrong("axis", "must point somewhere, as [1, 0, 0] does")
    least, most = table.number("min_deg"), table.number("max_deg")
    if not -90 <= least <= 0 <= most <= 90:
        raise table.wrong("max_deg", "and 'min_deg' must enclose 0, the mouth shut, and stay within 90 of it")
    pivot = joints.T_rig_joint[joint, :3, 3] - origin
    return Jaw(joint, axis / length, pivot, float(np.radians(least)), float(np.radians(most)))


def _secondary(table: Table, mesh: _Mesh, places: dict[str, int]) -> dict[int, PdGains]:
    joints = mesh.joints
    driven = {joint: what for what, joint in places.items()}
    gains = {}
    for name in table.values:
        if name not in joints.names:
            raise table.wrong(name, f"is no joint of the mesh{_near(name, mesh.node_names)}")
        joint = joints.index(name)
        if joint in driven:
            raise table.wrong(name, f"is driven already, as {driven[joint]}, and cannot trail")
        gains[joint] = read_gains(table.table(name))
    return gains


def _licence(table: Table) -> dict[str, str]:
    return {key: table.string(key) for key in table.values}


def _below(joints: Joints, top: int) -> frozenset[int]:
    """The joints below `top`, without itself."""
    found: set[int] = set()
    for j, parent in enumerate(joints.parents):  # parents stand first
        if parent == top or parent in found:
            found.add(j)
    return frozenset(found)


def _near(name: str, known: Collection[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""
