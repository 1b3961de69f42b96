"""The surfaces of a glTF file: triangles, bind positions in ``rig``, joint weights, blend shapes.

A skinned mesh ignores its node's transform; an unskinned one moves rigidly with the joint at or above its node, or with the first joint where
there is none. Blend shapes of equal name on several meshes are one shape of the rig.
Reference: glTF 2.0, section 3.7 (meshes, skins, morph targets).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget.errors import InputError
from retarget.rig.materials import read_material
from retarget.rig.model import Shape, Surface
from retarget.rig.normals import vertex_normals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.rig.fields import Fields
    from retarget.rig.glb import Glb
    from retarget.rig.nodes import Nodes, Skeleton

    Array = NDArray[np.float64]

TRIANGLES, STRIP, FAN = 4, 5, 6


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
    drawn = [(n, glb.entry("nodes", n)) for n in nodes.order if "mesh" in glb.entry("nodes", n).data]
    if not any("skin" in node for _, node in drawn):
        raise InputError(
            f"{glb.path.name} has no skin, so no joint would move its mesh; bind the mesh to an armature and export with skinning."
        )
    meshes = [glb.entry("meshes", node.integer("mesh")) for _, node in drawn]
    shape_names = tuple(dict.fromkeys(name for mesh in meshes for name in _shape_names(mesh)))
    surfaces: list[Surface] = []
    # Skins first: where a joint carries a rigid piece too, the skin's bind matrix is the joint's own.
    for (n, node), mesh in sorted(zip(drawn, meshes, strict=True), key=lambda item: "skin" not in item[0][1]):
        binding = _skin_binding(glb, node, nodes, skeleton) if "skin" in node else _rigid_binding(n, nodes, skeleton)
        primitives = [p for p in mesh.tables("primitives") if p.integer("mode", TRIANGLES) in (TRIANGLES, STRIP, FAN)]
        for i, primitive in enumerate(primitives):
            name = nodes.names[n] if len(primitives) == 1 else f"{nodes.names[n]}.{i}"
            surfaces.append(_read_surface(glb, mesh, primitive, name, binding, shape_names))
    return tuple(surfaces), shape_names


def _skin_binding(glb: Glb, node: Fields, nodes: Nodes, skeleton: Skeleton) -> _Binding:
    skin = glb.entry("skins", node.integer("skin"))
    listed = skin.integers("joints")
    if not listed:
        raise skin.wrong("joints", "a list of at least one node")
    T_node_mesh = np.tile(np.eye(4), (len(listed), 1, 1))
    if "inverseBindMatrices" in skin:
        T_node_mesh = _floats(glb, skin.integer("inverseBindMatrices"), (4, 4))
        if len(T_node_mesh) < len(listed):
            raise InputError(
                f"{skin.place} has {len(listed)} joints and only {len(T_node_mesh)} inverse bind matrices; export it again."
            )
    T_rig_mesh = nodes.T_rig_node[listed] @ T_node_mesh[: len(listed)]
    # Where the skeleton stands at rest as it was bound, these are all the same transform, which puts the mesh into `rig`.
    bind = T_rig_mesh[min(range(len(listed)), key=lambda i: nodes.order.index(listed[i]))]
    if abs(np.linalg.det(bind[:3, :3])) < 1e-15:
        bind = np.eye(4)
    T_rig_bound = T_rig_mesh @ np.linalg.inv(bind)
    slots = [skeleton.bind(skeleton.joint_of[n], T) for n, T in zip(listed, T_rig_bound, strict=True)]
    return _Binding(bind, np.array(slots, np.intp), skinned=True)


def _rigid_binding(n: int, nodes: Nodes, skeleton: Skeleton) -> _Binding:
    slot = skeleton.bind(max(skeleton.carrier(n), 0), np.eye(4))
    return _Binding(nodes.T_rig_node[n], np.array([slot], np.intp), skinned=False)


def _read_surface(
    glb: Glb, mesh: Fields, primitive: Fields, name: str, binding: _Binding, shape_names: tuple[str, ...]
) -> Surface:
    attributes = primitive.table("attributes")
    positions = (
        _floats(glb, attributes.integer("POSITION"), (3,)) @ binding.T_rig_mesh[:3, :3].T + binding.T_rig_mesh[:3, 3]
    )
    triangles = _triangles(glb, primitive, len(positions))
    if np.linalg.det(binding.T_rig_mesh[:3, :3]) < 0:
        triangles = triangles[:, ::-1]  # a mirror turns the winding round
    material, texcoord = read_material(glb, primitive)
    joints, weights = _influences(glb, attributes, binding, len(positions))
    return Surface(
        name=name,
        positions=positions.astype(np.float32),
        normals=_normals(glb, attributes, binding, positions, triangles),
        triangles=np.ascontiguousarray(triangles, np.int32),
        joints=joints,
        joint_weights=weights,
        shapes=_shapes(glb, mesh, primitive, binding, len(positions), shape_names),
        material=material,
        uv=_optional(glb, attributes, f"TEXCOORD_{texcoord}", len(positions), 2),
        colors=_colors(glb, attributes, len(positions)),
    )


def _floats(glb: Glb, index: int, shape: tuple[int, ...], count: int | None = None) -> Array:
    """An accessor as float64 with elements of `shape`, all finite; `count` of them where it is given."""
    place = f"{glb.path.name}, accessors[{index}]"
    fields = glb.entry("accessors", index)
    if count is not None and fields.integer("count") != count:
        raise InputError(
            f"{place} has {fields.integer('count')} elements for {count} vertices; the file is damaged, export it again."
        )
    values = glb.array(index)
    if values.shape[1:] != shape:
        raise InputError(f"{place} has elements of shape {values.shape[1:]}, where {shape} is needed; export it again.")
    values = values.astype(np.float64)
    if not np.isfinite(values).all():
        raise InputError(f"{place} holds values that are not finite; mend the mesh and export it again.")
    return values


def _triangles(glb: Glb, primitive: Fields, count: int) -> NDArray[np.int32]:
    """(F, 3) whatever the primitive's mode."""
    order = np.arange(count)
    if "indices" in primitive:
        order = glb.array(primitive.integer("indices"))
        if order.ndim != 1 or order.dtype.kind != "u" or (len(order) and int(order.max()) >= count):
            raise InputError(
                f"{primitive.place}: its triangles use vertices beyond the {count} there are; export it again."
            )
    order = order.astype(np.int32)
    mode = primitive.integer("mode", TRIANGLES)
    if mode == TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if mode == FAN:
        return np.stack([order[1:-1], order[2:], np.broadcast_to(order[:1], order[2:].shape)], axis=-1)
    strip = np.stack([order[:-2], order[1:-1], order[2:]], axis=-1)
    strip[1::2] = strip[1::2, [0, 2, 1]]  # every other triangle of a strip is listed the other way round
    return strip


def _influences(
    glb: Glb, attributes: Fields, binding: _Binding, count: int
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """(V, I) joints and weights, rows adding up to 1; a vertex without any weight goes with the skin's first joint."""
    if not binding.skinned:
        return np.full((count, 1), binding.slots[0]), np.ones((count, 1), np.float32)
    sets = 0
    numbers, weights = [], []
    while f"JOINTS_{sets}" in attributes and f"WEIGHTS_{sets}" in attributes:
        numbers.append(_floats(glb, attributes.integer(f"JOINTS_{sets}"), (4,), count).astype(np.intp))
        weights.append(_floats(glb, attributes.integer(f"WEIGHTS_{sets}"), (4,), count))
        sets += 1
    if not sets:
        raise InputError(
            f"{attributes.place} lacks JOINTS_0 and WEIGHTS_0, though its node has a skin; export it with skinning."
        )
    number, weight = np.concatenate(numbers, axis=1), np.maximum(np.concatenate(weights, axis=1), 0.0)
    number = np.where(weight > 0, number, 0)
    if count and int(number.max()) >= len(binding.slots):
        raise InputError(
            f"{attributes.place} uses joint {number.max()} of a skin of {len(binding.slots)}; export it again."
        )
    weight[weight.sum(axis=1) <= 0, 0] = 1.0
    used = (weight > 0).any(axis=0)
    weight = weight[:, used] / weight.sum(axis=1, keepdims=True)
    return binding.slots[number[:, used]], weight.astype(np.float32)


def _normals(
    glb: Glb, attributes: Fields, binding: _Binding, positions: Array, triangles: NDArray[np.int32]
) -> NDArray[np.float32]:
    """As given, turned into ``rig``; computed where there are none, or where one has no length."""
    computed = vertex_normals(positions, triangles)
    if "NORMAL" not in attributes:
        return computed
    given = _floats(glb, attributes.integer("NORMAL"), (3,), len(positions)) @ np.linalg.inv(binding.T_rig_mesh[:3, :3])
    length = np.linalg.norm(given, axis=1, keepdims=True)
    return np.where(length > 0, given / np.where(length > 0, length, 1.0), computed).astype(np.float32)


def _shape_names(mesh: Fields) -> list[str]:
    """Names of a mesh's blend shapes: its extras' `targetNames`, else those of a primitive's extras, else the mesh's name and a number."""
    primitives = mesh.tables("primitives")
    count = max((len(p.tables("targets")) for p in primitives), default=0)
    if not count:
        return []
    named = next((n for n in (_target_names(part) for part in (mesh, *primitives)) if n), [])
    names = named[:count] or [f"{mesh.text('name', '') or 'shape'}{i}" for i in range(count)]
    if len(set(names)) < count:
        raise InputError(
            f"{mesh.place} has {count} blend shapes with {len(set(names))} different names; rename them and export again."
        )
    return names


def _target_names(part: Fields) -> list[str]:
    extras = part.data.get("extras")
    return part.table("extras").texts("targetNames") if isinstance(extras, dict) else []


def _shapes(
    glb: Glb, mesh: Fields, primitive: Fields, binding: _Binding, count: int, shape_names: tuple[str, ...]
) -> tuple[Shape, ...]:
    targets = dict(zip(_shape_names(mesh), primitive.tables("targets"), strict=False))
    still = Shape(np.zeros(0, np.intp), np.zeros((0, 3), np.float32))
    return tuple(
        _shape(glb, targets[name], binding, count) if name in targets and "POSITION" in targets[name] else still
        for name in shape_names
    )


def _shape(glb: Glb, target: Fields, binding: _Binding, count: int) -> Shape:
    offsets = (_floats(glb, target.integer("POSITION"), (3,), count) @ binding.T_rig_mesh[:3, :3].T).astype(np.float32)
    moved = np.flatnonzero(offsets.any(axis=1))
    return Shape(moved, offsets[moved])


def _optional(glb: Glb, attributes: Fields, key: str, count: int, width: int) -> NDArray[np.float32] | None:
    if key not in attributes:
        return None
    return _floats(glb, attributes.integer(key), (width,), count).astype(np.float32)


def _colors(glb: Glb, attributes: Fields, count: int) -> NDArray[np.float32] | None:
    """(V, 4); colours of three parts are opaque."""
    if "COLOR_0" not in attributes:
        return None
    index = attributes.integer("COLOR_0")
    width = 3 if glb.entry("accessors", index).data.get("type") == "VEC3" else 4
    values: NDArray[Any] = _floats(glb, index, (width,), count)
    opaque = np.ones((count, 4 - width))
    return np.concatenate([values, opaque], axis=1).astype(np.float32)
