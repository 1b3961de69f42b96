"""A GLB as pygltflib reads it, for the tests of the rigs: independent of the package's own reader."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pygltflib import GLTF2

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

_TYPES = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """One primitive."""

    name: str
    positions: NDArray[Any]
    normals: NDArray[Any]
    triangles: NDArray[Any]
    joints: NDArray[Any]
    weights: NDArray[Any]
    targets: tuple[NDArray[Any], ...]

    def weights_of(self, joints: set[int]) -> NDArray[Any]:
        """(V,) how much each vertex follows these joints together."""
        return np.asarray((self.weights * np.isin(self.joints, list(joints))).sum(1))


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """A skinned mesh."""

    document: GLTF2
    surfaces: dict[str, Surface]
    shape_names: list[str]
    joints: list[str]
    parents: dict[str, str | None]
    places: dict[str, NDArray[Any]]
    """Rest position (3,) of every joint, for rest rotations that are the identity."""
    inverse_bind: NDArray[Any]
    """(J, 4, 4)."""


def read(path: Path) -> Model:
    """The model in a GLB file with one mesh and one skin."""
    document = GLTF2().load(str(path))
    mesh, skin, nodes = document.meshes[0], document.skins[0], document.nodes
    above = {child: number for number, node in enumerate(nodes) for child in node.children or []}
    names = [nodes[joint].name for joint in skin.joints]
    parents = {nodes[j].name: nodes[above[j]].name if j in above else None for j in skin.joints}
    places: dict[str, NDArray[Any]] = {}
    for joint in skin.joints:
        parent = parents[nodes[joint].name]
        origin = places[parent] if parent else np.zeros(3)
        places[nodes[joint].name] = origin + np.array(nodes[joint].translation)
    surfaces = [_surface(document, primitive) for primitive in mesh.primitives]
    inverse = _accessor(document, skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
    return Model(document, {s.name: s for s in surfaces}, mesh.extras["targetNames"], names, parents, places, inverse)


def _surface(document: GLTF2, primitive: Any) -> Surface:
    attributes = primitive.attributes
    return Surface(
        document.materials[primitive.material].name,
        _accessor(document, attributes.POSITION),
        _accessor(document, attributes.NORMAL),
        _accessor(document, primitive.indices).reshape(-1, 3).astype(int),
        _accessor(document, attributes.JOINTS_0).astype(int),
        _accessor(document, attributes.WEIGHTS_0),
        tuple(_accessor(document, _position(target)) for target in primitive.targets),
    )


def _position(target: Any) -> int:
    return int(target["POSITION"] if isinstance(target, dict) else target.POSITION)


def _accessor(document: GLTF2, number: int) -> NDArray[Any]:
    accessor = document.accessors[number]
    kind, width = _TYPES[accessor.componentType], _WIDTHS[accessor.type]
    if accessor.bufferView is None:
        values = np.zeros((accessor.count, width), kind)
    else:
        values = _view(document, accessor.bufferView, accessor.byteOffset, kind, accessor.count * width)
        values = values.reshape(-1, width).copy()
    if accessor.sparse:
        sparse = accessor.sparse
        index = _view(document, sparse.indices.bufferView, 0, _TYPES[sparse.indices.componentType], sparse.count)
        values[index] = _view(document, sparse.values.bufferView, 0, kind, sparse.count * width).reshape(-1, width)
    return values


def _view(document: GLTF2, number: int, offset: int | None, kind: str, count: int) -> NDArray[Any]:
    view = document.bufferViews[number]
    start = (view.byteOffset or 0) + (offset or 0)
    return np.frombuffer(document.binary_blob(), kind, count, start)
