"""Rigs on disk: `rig.toml`, which says what the joints of a GLB mean, and the rigs that ship with the package.

rig.toml, version 1::

    name = "human"
    mesh = "human.glb"                 # beside this file
    faces = "+z"                       # or "-z": where the character looks in the mesh; may be left out
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
    chin = [0.0, 0.05, 0.1]            # or a place on the mesh [m], for a mesh that blend shapes alone can move there
    [shapes]                           # the mesh's blend shapes by our names; see `retarget.rig.shape_names`
    jawOpen = "mouth_a"
    [responses]                        # may be left out; see `retarget.rig.responses`
    jawOpen = { measure = "mouth_width", curve = "ramp", start = 0.02, end = 0.3 }
    [secondary]                        # joints that trail, may be left out; see `retarget.rig.secondary`
    pendantLeft = { alpha = 0.9 }
    [licence]                          # any texts: name, source, author, ...
    name = "CC0-1.0"
"""

from __future__ import annotations

import difflib
import logging
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from retarget.errors import InputError
from retarget.rig.glb import read_glb
from retarget.rig.library import RIG_FILE, all_rigs, shipped_rigs
from retarget.rig.model import Jaw, Rig, Site
from retarget.rig.nodes import read_nodes, read_skeleton
from retarget.rig.responses import read_responses
from retarget.rig.secondary import read_gains
from retarget.rig.shape_names import read_shape_names, renamed
from retarget.rig.surfaces import read_surfaces
from retarget.toml_table import read_table

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from numpy.typing import NDArray

    from retarget.filters import PdGains
    from retarget.rig.model import Joints, Surface
    from retarget.toml_table import Table

    Array = NDArray[np.float64]

KEYS = ("version", "name", "mesh", "faces", "joints", "jaw", "sites", "shapes", "responses", "secondary", "licence")
LOG = logging.getLogger(__name__)
T_RIG_FILE: dict[str, Array | None] = {"+z": None, "-z": np.diag([-1.0, 1.0, -1.0, 1.0])}
"""By the direction in which the character looks in the mesh."""
JAW_RIDERS = ("lipLower", "chin", "mandible")
"""Beginnings of the names of sites whose markers ride on the jaw."""


@dataclass(frozen=True, slots=True)
class RigSummary:
    """One line about a rig that can be had by name."""

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
    """The rig that ships or was added under this name, or that of a folder with a rig.toml, or of a rig.toml.

    Raises InputError where there is none, or where its files cannot be used.
    """
    return _read_rig(_find(name_or_path))


def available_rigs() -> tuple[RigSummary, ...]:
    """The rigs that ship with the package and those that the user has added; reads them all.

    One of the user's that cannot be read is passed over with a warning.
    """
    summaries = [_summary(path) for path in shipped_rigs().values()]
    for name, path in all_rigs().items():
        if name not in shipped_rigs():
            try:
                summaries.append(_summary(path))
            except InputError as error:
                LOG.warning("The rig %r cannot be used: %s", name, error)
    return tuple(summaries)


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


def _find(name_or_path: str) -> Path:
    """The rig.toml that is meant."""
    known = all_rigs()
    if name_or_path in known:
        return known[name_or_path]
    path = Path(name_or_path)
    if path.is_dir():
        path /= RIG_FILE
    if path.suffix == ".toml" and path.is_file():
        return path
    if path.suffix == ".glb" and path.is_file():
        return _beside(path)
    raise InputError(
        f"There is no rig {name_or_path!r}{_near(name_or_path, known)}. Name one that ships "
        f"({', '.join(shipped_rigs())}), one that you have added{_list(set(known) - set(shipped_rigs()))}, "
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
    root.only(*KEYS)
    if root.values.get("version", 1) != 1:
        raise root.wrong("version", "must be 1, the only version there is")
    named = _named_joints(root)
    file = root.string("mesh")
    trailing = root.table("secondary").values
    names = {table.string(key) for table, key in named.values()} | set(trailing)
    mesh = _read_mesh(path.parent / file, names, T_RIG_FILE[_facing(root)], _placed(root))
    joints = mesh.joints
    shapes = read_shape_names(root.table("shapes"), mesh.shape_names)
    shape_names = tuple(shapes) if "shapes" in root.values else mesh.shape_names
    places = {what: _joint(mesh, table, key, file) for what, (table, key) in named.items()}
    places |= {f"sites.{site}": joints.index(place.joint) for site, place in mesh.placed.items()}
    origin = joints.T_rig_joint[places["head"], :3, 3]
    return Rig(
        name=root.string("name"),
        path=path,
        joints=joints,
        surfaces=renamed(mesh.surfaces, mesh.shape_names, shapes) if "shapes" in root.values else mesh.surfaces,
        shape_names=shape_names,
        sites=_sites(root.table("sites"), joints, places, origin),
        head_joint=places["head"],
        neck_joint=places.get("neck"),
        eye_joints=(places.get("eye_left"), places.get("eye_right")),
        jaw=_jaw(root.table("jaw"), joints, places["jaw"], origin) if "jaw" in places else None,
        licence=_licence(root.table("licence")),
        responses=read_responses(root.table("responses"), shape_names),
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
    return named | {f"sites.{site}": (sites, site) for site, value in sites.values.items() if isinstance(value, str)}


class _Place(NamedTuple):
    """A site on the mesh that has no joint of the file's."""

    joint: str
    """Of the joint that is added for it."""
    position: Array
    """(3,) [m], ``rig``."""
    parent: str


def _placed(root: Table) -> dict[str, _Place]:
    """Sites that are given by a place; they hang on the head, or on the jaw where markers there ride on it."""
    sites, joints = root.table("sites"), root.table("joints")
    head = joints.string("head")
    jaw = root.table("jaw").string("joint") if "jaw" in root.values else head
    return {
        site: _Place(f"{site}.place", sites.array(site, (3,)), jaw if site.startswith(JAW_RIDERS) else head)
        for site, value in sites.values.items()
        if not isinstance(value, str)
    }


def _facing(root: Table) -> str:
    facing = root.string("faces") if "faces" in root.values else "+z"
    if facing not in T_RIG_FILE:
        raise root.wrong("faces", f"must be one of {', '.join(T_RIG_FILE)}")
    return facing


class _Mesh(NamedTuple):
    """What a GLB holds."""

    joints: Joints
    surfaces: tuple[Surface, ...]
    shape_names: tuple[str, ...]
    node_names: tuple[str, ...]
    """Of all nodes: what could be a joint."""
    placed: Mapping[str, _Place]
    """Sites without a joint of the file's."""


def _read_mesh(
    path: Path, named: Collection[str], T_rig_file: Array | None = None, placed: Mapping[str, _Place] | None = None
) -> _Mesh:
    """The GLB at `path`; `named` nodes are joints even without a skin, and each of `placed` gets one."""
    glb = read_glb(path)
    nodes = read_nodes(glb, T_rig_file)
    skeleton = read_skeleton(glb, nodes, named)
    surfaces, shape_names = read_surfaces(glb, nodes, skeleton)
    for place in (placed or {}).values():
        if place.parent in skeleton.names:
            skeleton.place(place.joint, place.parent, place.position)
    return _Mesh(skeleton.joints(), surfaces, shape_names, nodes.names, placed or {})


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


def _list(names: Collection[str]) -> str:
    return f" ({', '.join(sorted(names))})" if names else ""


def _near(name: str, known: Collection[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""
