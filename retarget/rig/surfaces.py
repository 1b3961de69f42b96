"""The surfaces of a glTF file: triangles, bind positions in ``rig``, joint weights, blend shapes.

A skinned mesh ignores its node's transform; an unskinned one moves rigidly with the joint at or above its node, or with
the first joint where there is none. Blend shapes of equal name on several meshes are one shape of the rig. Points and
lines are not drawn, and the pose alone says how much of a shape is shown.
Reference: glTF 2.0, section 3.7 (meshes, skins, morph targets).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError
from retarget.rig.attributes import read_colors, read_floats, read_influences, read_optional, read_triangles
from retarget.rig.fields import LARGEST
from retarget.rig.glb import DAMAGED
from retarget.rig.materials import Materials
from retarget.rig.model import Shape, Surface
from retarget.rig.normals import vertex_normals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.rig.fields import Fields
    from retarget.rig.glb import Glb
    from retarget.rig.nodes import Nodes, Skeleton

    Array = NDArray[np.float64]

TRIANGLE_MODES = (4, 5, 6)
"""Primitives that are triangles: a list, a strip, a fan."""


@dataclass(frozen=True, slots=True, eq=False)
class _Binding:
    """Where a mesh node's vertices are in ``rig``, and what carries them."""

    T_rig_mesh: Array
    """(4, 4), may hold scale: mesh coordinates to the bind pose in ``rig``."""
    slots: NDArray[np.intp]
    """The rig's joint for every joint number of the mesh; one alone where the mesh has no skin."""
    skinned: bool


def read_surfaces(glb: Glb, nodes: Nodes, skeleton: Skeleton) -> tuple[tuple[Surface, ...], tuple[str, ...]]:
    """All surfaces of the scene and the names of the blend shapes; binds joints of the `skeleton` on the way."""
    drawn = [n for n in nodes.order if "mesh" in glb.entry("nodes", n)]
    # Skins first: where a joint carries a rigid piece too, the skin's bind matrix is the joint's own.
    drawn.sort(key=lambda n: "skin" not in glb.entry("nodes", n))
    meshes = [glb.entry("meshes", glb.entry("nodes", n).integer("mesh")) for n in drawn]
    shape_names = tuple(dict.fromkeys(name for mesh in meshes for name in target_names(mesh)))
    if not shape_names and (not drawn or "skin" not in glb.entry("nodes", drawn[0])):
        raise InputError(
            f"{glb.path.name} has no skin and no blend shapes, so nothing would move its mesh; bind it to an armature "
            "or give it blend shapes, and export those too."
        )
    reader = _Reader(glb, shape_names)
    surfaces = []
    for n, mesh in zip(drawn, meshes, strict=True):
        node = glb.entry("nodes", n)
        binding = _skin_binding(glb, node, nodes, skeleton) if "skin" in node else _rigid_binding(n, nodes, skeleton)
        surfaces += reader.surfaces(mesh, nodes.names[n], binding)
    if not surfaces:
        raise InputError(f"{glb.path.name} has no triangles; export the mesh with its faces.")
    return tuple(surfaces), shape_names


class _Reader:
    """Reads the primitives of one file's meshes."""

    def __init__(self, glb: Glb, shape_names: tuple[str, ...]) -> None:
        self._glb = glb
        self._shape_names = shape_names
        self._materials = Materials(glb)

    def surfaces(self, mesh: Fields, name: str, binding: _Binding) -> list[Surface]:
        """One surface for every primitive of the mesh, named after its node."""
        primitives = [p for p in mesh.tables("primitives") if p.integer("mode", TRIANGLE_MODES[0]) in TRIANGLE_MODES]
        names = [name] if len(primitives) == 1 else [f"{name}.{i}" for i in range(len(primitives))]
        targets = target_names(mesh)
        return [self._surface(p, n, targets, binding) for p, n in zip(primitives, names, strict=True)]

    def _surface(self, primitive: Fields, name: str, targets: list[str], binding: _Binding) -> Surface:
        glb, T_rig_mesh = self._glb, binding.T_rig_mesh
        attributes = primitive.table("attributes")
        positions = read_floats(glb, attributes.integer("POSITION"), (3,)) @ T_rig_mesh[:3, :3].T + T_rig_mesh[:3, 3]
        count = len(positions)
        if not count or np.abs(positions).max() > LARGEST:
            raise InputError(f"{primitive.place} has no vertices, or some beyond all measure; {DAMAGED}.")
        triangles = read_triangles(glb, primitive, count)
        if np.linalg.det(T_rig_mesh[:3, :3]) < 0:
            triangles = np.ascontiguousarray(triangles[:, ::-1])  # a mirror turns the winding round
        joints, weights = _influences(glb, attributes, binding, count)
        material, texcoord = self._materials.of(primitive)
        return Surface(
            name=name,
            positions=positions.astype(np.float32),
            normals=_normals(glb, attributes, T_rig_mesh[:3, :3], positions, triangles),
            triangles=triangles,
            joints=joints,
            joint_weights=weights,
            shapes=self._shapes(dict(zip(targets, primitive.tables("targets"), strict=False)), T_rig_mesh, count),
            material=material,
            uv=read_optional(glb, attributes, f"TEXCOORD_{texcoord}", (2,), count),
            colors=read_colors(glb, attributes, count),
        )

    def _shapes(self, targets: dict[str, Fields], T_rig_mesh: Array, count: int) -> tuple[Shape, ...]:
        still = Shape(np.zeros(0, np.intp), np.zeros((0, 3), np.float32))
        return tuple(
            self._shape(targets[name], T_rig_mesh, count) if name in targets and "POSITION" in targets[name] else still
            for name in self._shape_names
        )

    def _shape(self, target: Fields, T_rig_mesh: Array, count: int) -> Shape:
        given = read_floats(self._glb, target.integer("POSITION"), (3,), count)
        offsets = (given @ T_rig_mesh[:3, :3].T).astype(np.float32)
        moved = np.flatnonzero(offsets.any(axis=1))
        return Shape(moved, offsets[moved])


def _skin_binding(glb: Glb, node: Fields, nodes: Nodes, skeleton: Skeleton) -> _Binding:
    skin = glb.entry("skins", node.integer("skin"))
    listed = skin.integers("joints")
    if not listed:
        raise skin.wrong("joints", "a list of at least one node")
    T_node_mesh = np.tile(np.eye(4), (len(listed), 1, 1))
    if "inverseBindMatrices" in skin:
        given = read_floats(glb, skin.integer("inverseBindMatrices"), (4, 4))
        if len(given) < len(listed):
            raise InputError(
                f"{skin.place} has {len(listed)} joints and {len(given)} inverse bind matrices; {DAMAGED}."
            )
        T_node_mesh[:, :3] = given[: len(listed), :3]
    T_rig_mesh = nodes.T_rig_node[listed] @ T_node_mesh
    # Where the skeleton rests as it was bound, these are all the same transform, which puts the mesh into `rig`.
    bind = T_rig_mesh[min(range(len(listed)), key=lambda i: nodes.order.index(listed[i]))]
    if abs(np.linalg.det(bind[:3, :3])) < 1e-15:
        bind = np.eye(4)
    T_rig_bound = T_rig_mesh @ np.linalg.inv(bind)
    if np.abs(T_rig_bound).max() > LARGEST:
        raise InputError(f"{skin.place} has inverse bind matrices that cannot be used; {DAMAGED}.")
    slots = [skeleton.bind(skeleton.joint_of[n], T) for n, T in zip(listed, T_rig_bound, strict=True)]
    return _Binding(bind, np.array(slots, np.intp), skinned=True)


def _rigid_binding(n: int, nodes: Nodes, skeleton: Skeleton) -> _Binding:
    slot = skeleton.bind(max(skeleton.carrier(n), 0), np.eye(4))
    return _Binding(nodes.T_rig_node[n], np.array([slot], np.intp), skinned=False)


def _influences(
    glb: Glb, attributes: Fields, binding: _Binding, count: int
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """(V, I) joints of the rig and weights."""
    if not binding.skinned:
        return np.full((count, 1), binding.slots[0]), np.ones((count, 1), np.float32)
    numbers, weights = read_influences(glb, attributes, len(binding.slots), count)
    return binding.slots[numbers], weights


def _normals(
    glb: Glb, attributes: Fields, M: Array, positions: Array, triangles: NDArray[np.int32]
) -> NDArray[np.float32]:
    """As given, turned into ``rig`` by M (3, 3); computed where there are none, or where one has no length."""
    computed = vertex_normals(positions, triangles)
    given = read_optional(glb, attributes, "NORMAL", (3,), len(positions))
    if given is None:
        return computed
    # The cofactors are the inverse transpose times the determinant, and exist for every M.
    cofactors = np.cross(M[[1, 2, 0]], M[[2, 0, 1]])
    turned = given.astype(np.float64) @ cofactors.T * np.sign(np.linalg.det(M))
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    return np.where(length > 0, turned / np.where(length > 0, length, 1.0), computed).astype(np.float32)


def target_names(mesh: Fields) -> list[str]:
    """Names of a mesh's blend shapes: `targetNames` of its extras or a primitive's, else its name and a number."""
    primitives = mesh.tables("primitives")
    count = max((len(p.tables("targets")) for p in primitives), default=0)
    given = [part.table("extras").texts("targetNames") for part in (mesh, *primitives) if "extras" in part]
    names = next((found[:count] for found in given if found), [])
    names += [f"{mesh.text('name', '') or 'shape'}{i}" for i in range(len(names), count)]
    if len(set(names)) < count:
        raise InputError(
            f"{mesh.place} has {count} blend shapes of {len(set(names))} names; rename them and export again."
        )
    return names
