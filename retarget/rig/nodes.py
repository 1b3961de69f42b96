"""The node hierarchy of a glTF scene, and the rig's joints in it.

Joints are the nodes that a skin lists and those that `rig.toml` names. Other nodes between or above them never move, so
they are folded into the rest transform of the joint below. Joints move rigidly: scale in the hierarchy is folded into
the bind matrices, and translations of joints are metres of ``rig`` whatever the scale above them. So uniform scale is
exact; scale that differs between axes above a joint that turns stays in the joint's own axes, without glTF's shear.
Reference: glTF 2.0, sections 3.5.3 (transformations) and 3.7.3 (skins).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError
from retarget.geometry import inverse, matrix_from_quat, quat_from_matrix, transform
from retarget.rig.fields import LARGEST
from retarget.rig.glb import DAMAGED
from retarget.rig.model import Joints

if TYPE_CHECKING:
    from collections.abc import Collection

    from numpy.typing import NDArray

    from retarget.rig.fields import Fields
    from retarget.rig.glb import Glb

    Array = NDArray[np.float64]

SAME_BINDING = 1e-5
"""Largest difference between entries of bind matrices that counts as none; in metres for the translation."""


@dataclass(frozen=True, slots=True, eq=False)
class Nodes:
    """All nodes of the scene that is shown; the arrays are indexed as in the file."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    """-1 for a root, and for a node outside the scene."""
    order: tuple[int, ...]
    """The nodes of the scene, parents before children."""
    T_rig_node: Array
    """(N, 4, 4) at rest, may hold scale; identity outside the scene."""


class Skeleton:
    """The joints of a rig while it is read; grows where one joint is bound in two ways.

    A rig's joint has one bind matrix. Where a second skin binds the same joint differently, a twin that rides on the
    joint takes the second matrix, so that every surface moves as glTF says.
    """

    def __init__(self, nodes: Nodes, joint_nodes: Collection[int]) -> None:
        self.node_of = [n for n in nodes.order if n in joint_nodes]
        self.joint_of = {n: j for j, n in enumerate(self.node_of)}
        self._nodes = nodes
        self._names = [nodes.names[n] for n in self.node_of]
        self._parents = [self.carrier(nodes.parents[n]) for n in self.node_of]
        self._T_rig_joint = [_nearest_rigid(nodes.T_rig_node[n]) for n in self.node_of]
        self._bindings: list[Array | None] = [None] * len(self.node_of)
        self._twins: dict[int, list[int]] = {}

    def carrier(self, node: int) -> int:
        """The joint at `node` or the nearest above it; -1 where there is none."""
        while node >= 0 and node not in self.joint_of:
            node = self._nodes.parents[node]
        return self.joint_of.get(node, -1)

    def bind(self, joint: int, T_rig_mesh: Array) -> int:
        """The joint, or its twin, that takes mesh points to `T_rig_mesh` (4, 4) at rest."""
        T_joint_mesh = inverse(self._T_rig_joint[joint]) @ T_rig_mesh
        for candidate in [joint, *self._twins.get(joint, [])]:
            known = self._bindings[candidate]
            if known is None:
                self._bindings[candidate] = T_joint_mesh
                return candidate
            if np.abs(known - T_joint_mesh).max() < SAME_BINDING:
                return candidate
        twins = self._twins.setdefault(joint, [])
        twins.append(len(self._names))
        self._names.append(f"{self._names[joint]}.binding{len(twins) + 1}")
        self._parents.append(joint)
        self._T_rig_joint.append(self._T_rig_joint[joint])
        self._bindings.append(T_joint_mesh)
        return twins[-1]

    def place(self, name: str, parent: str, position: Array) -> None:
        """Add a joint that no skin uses, at `position` (3,) [m], ``rig``, with the rest rotation of its `parent`."""
        above = self._names.index(parent)
        self._names.append(name)
        self._parents.append(above)
        self._T_rig_joint.append(transform(self._T_rig_joint[above][:3, :3], position))
        self._bindings.append(None)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the joints so far."""
        return tuple(self._names)

    def joints(self) -> Joints:
        """The joints with everything bound so far."""
        T_rig_joint = np.array(self._T_rig_joint)
        parents = np.array(self._parents, np.intp)
        T_rig_parent = np.where((parents < 0)[:, None, None], np.eye(4), T_rig_joint[parents])
        T_parent_joint = inverse(T_rig_parent) @ T_rig_joint
        unbound = np.full((4, 4), np.nan)
        return Joints(
            names=tuple(self._names),
            parents=parents,
            translations=T_parent_joint[:, :3, 3],
            rotations=quat_from_matrix(T_parent_joint[:, :3, :3]),
            T_rig_joint=T_rig_joint,
            T_joint_mesh=np.array([unbound if T is None else T for T in self._bindings]),
        )


def read_nodes(glb: Glb, T_rig_file: Array | None = None) -> Nodes:
    """The hierarchy of the default scene; InputError where it is no forest.

    `T_rig_file` (4, 4) turns a file whose character does not look along +Z.
    """
    items = glb.document.tables("nodes")
    parents = [-1] * len(items)
    children = [item.integers("children") for item in items]
    for parent, below in enumerate(children):
        for child in below:
            glb.entry("nodes", child)
            if parents[child] >= 0:
                raise InputError(f"{items[child].place} has two parents; {DAMAGED}.")
            parents[child] = parent
    order = _parents_first(glb, parents, children)
    T_rig_root = np.eye(4) if T_rig_file is None else T_rig_file
    T_rig_node = np.tile(np.eye(4), (len(items), 1, 1))
    for n in order:
        local = _local_transform(items[n])
        T_rig_node[n] = (T_rig_root if parents[n] < 0 else T_rig_node[parents[n]]) @ local
        if np.abs(T_rig_node[n]).max() > LARGEST:
            raise InputError(f"{items[n].place} is placed or scaled beyond all measure; {DAMAGED}.")
    names = tuple(item.text("name", "") or f"node{n}" for n, item in enumerate(items))
    return Nodes(names, tuple(parents), tuple(order), T_rig_node)


def read_skeleton(glb: Glb, nodes: Nodes, named: Collection[str]) -> Skeleton:
    """Joints are the nodes of all skins and those `named`, or the roots where there are none of either; InputError
    where two of them share a name.
    """
    listed = {n for skin in glb.document.tables("skins") for n in skin.integers("joints")}
    inside = set(nodes.order)
    for n in listed - inside:
        raise InputError(f"{glb.path.name}: a skin uses nodes[{n}], which is not in the scene; export them together.")
    wanted = set(named) - {nodes.names[n] for n in listed}  # a mesh is often named as the joint that it hangs on
    chosen = listed | {n for n in inside if nodes.names[n] in wanted}
    if not chosen:  # without a skin and without names all hangs on the roots
        chosen = {n for n in inside if nodes.parents[n] < 0}
    seen: set[str] = set()
    for n in chosen:
        if nodes.names[n] in seen:
            raise InputError(
                f"{glb.path.name} has two joints named {nodes.names[n]!r}; rename one and export it again."
            )
        seen.add(nodes.names[n])
    return Skeleton(nodes, chosen)


def _parents_first(glb: Glb, parents: list[int], children: list[list[int]]) -> list[int]:
    """Breadth first, so that joints of one depth lie side by side."""
    if "scenes" in glb.document:
        order = list(glb.entry("scenes", glb.document.integer("scene", 0)).integers("nodes"))
    else:
        order = [n for n, parent in enumerate(parents) if parent < 0]
    for n in order:
        glb.entry("nodes", n)
        if parents[n] >= 0:
            raise InputError(f"{glb.path.name}: the root nodes[{n}] of the scene has a parent; {DAMAGED}.")
    if len(set(order)) < len(order):
        raise InputError(f"{glb.path.name}: a scene lists a root node twice; {DAMAGED}.")
    for n in order:  # grows while it is read; ends, since no node has two parents and roots have none
        order.extend(children[n])
    return order


def _local_transform(node: Fields) -> Array:
    """T_parent_node (4, 4); may hold scale."""
    if "matrix" in node:
        T = np.array(node.numbers("matrix", 16)).reshape(4, 4).T
        T[3] = (0.0, 0.0, 0.0, 1.0)
        return T
    rotation = np.array(node.numbers("rotation", 4, (0.0, 0.0, 0.0, 1.0)))
    length = np.linalg.norm(rotation)
    if length < 1e-6:
        raise node.wrong("rotation", "a unit quaternion")
    scale = np.array(node.numbers("scale", 3, (1.0, 1.0, 1.0)))
    return transform(matrix_from_quat(rotation / length) * scale, node.numbers("translation", 3, (0.0, 0.0, 0.0)))


def _nearest_rigid(T: Array) -> Array:
    """The rigid transform of the same origin whose rotation is nearest to `T` (polar decomposition, Higham 1986)."""
    U, _, Vt = np.linalg.svd(T[:3, :3])
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(U) * np.linalg.det(Vt))])
    return transform((U * sign) @ Vt, T[:3, 3])
