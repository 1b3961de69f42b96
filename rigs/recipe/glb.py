"""Write the parts as one binary glTF 2.0 file: a skinned mesh with sparse morph targets and embedded pictures.

The same input gives the same bytes. Reference: glTF 2.0 specification, sections 3.6 (accessors), 3.7.2.2 (morph
targets), 4.4 (GLB).
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.part import Part
    from rigs.recipe.skeleton import Skeleton

FLOAT, UINT, USHORT, UBYTE = 5126, 5125, 5123, 5121
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
SMALLEST_OFFSET_M = 2e-5
"""A morph target leaves out what moves less."""
_COMPONENTS = {np.dtype("<f4"): FLOAT, np.dtype("<u4"): UINT, np.dtype("<u2"): USHORT, np.dtype("u1"): UBYTE}
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


@dataclass(frozen=True, slots=True)
class Look:
    """A material: a picture as PNG or JPEG bytes, and how rough the surface is."""

    picture: bytes
    roughness: float
    double_sided: bool = False


@dataclass(slots=True)
class _Writer:
    document: dict[str, Any]
    blob: bytearray = field(default_factory=bytearray)

    def view(self, data: bytes, target: int | None = None) -> int:
        self.blob += b"\0" * (-len(self.blob) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data)}
        self.blob += data
        self.document["bufferViews"].append(entry | ({"target": target} if target else {}))
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values: NDArray[Any], target: int | None = None, *, bounds: bool = False) -> int:
        width = int(np.prod(values.shape[1:]))
        entry = {
            "bufferView": self.view(np.ascontiguousarray(values).tobytes(), target),
            "componentType": _COMPONENTS[values.dtype],
            "count": len(values),
            "type": _TYPES[width],
        }
        return self._add(entry | (_bounds(values) if bounds else {}))

    def sparse(self, offsets: NDArray[np.float32]) -> int:
        """An accessor of offsets that are zero but for a few vertices."""
        moved = np.flatnonzero(np.linalg.norm(offsets, axis=1) > SMALLEST_OFFSET_M)
        kept = np.zeros_like(offsets)
        kept[moved] = offsets[moved]
        entry = {"componentType": FLOAT, "count": len(offsets), "type": "VEC3"} | _bounds(kept)
        if len(moved):
            entry["sparse"] = {
                "count": len(moved),
                "indices": {"bufferView": self.view(moved.astype("<u2").tobytes()), "componentType": USHORT},
                "values": {"bufferView": self.view(kept[moved].astype("<f4").tobytes())},
            }
        return self._add(entry)

    def _add(self, entry: dict[str, Any]) -> int:
        self.document["accessors"].append(entry)
        return len(self.document["accessors"]) - 1


def _bounds(values: NDArray[Any]) -> dict[str, list[float]]:
    return {"min": values.min(0).astype(float).tolist(), "max": values.max(0).astype(float).tolist()}


def write_glb(
    name: str, parts: list[Part], looks: list[Look], skeleton: Skeleton, shapes: tuple[str, ...], asset: dict[str, str]
) -> bytes:
    """The GLB file's bytes; `looks` go with `parts`, `shapes` gives the order of the morph targets."""
    joints = len(skeleton.names)
    roots = [joint for joint, parent in enumerate(skeleton.parents) if parent < 0]
    document: dict[str, Any] = {
        "asset": {"version": "2.0"} | asset,
        "scene": 0,
        "scenes": [{"name": name, "nodes": [*roots, joints]}],
        "nodes": [*_nodes(skeleton), {"name": name, "mesh": 0, "skin": 0}],
        "meshes": [],
        "skins": [],
        "materials": [],
        "textures": [],
        "images": [],
        "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}],
        "accessors": [],
        "bufferViews": [],
    }
    writer = _Writer(document)
    primitives = [_primitive(writer, part, number, shapes) for number, part in enumerate(parts)]
    document["meshes"].append(
        {
            "name": name,
            "primitives": primitives,
            "weights": [0.0] * len(shapes),
            "extras": {"targetNames": list(shapes)},
        }
    )
    for part, look in zip(parts, looks, strict=True):
        _material(writer, part.name, look)
    document["skins"].append(_skin(writer, skeleton, roots[0]))
    document["buffers"] = [{"byteLength": len(writer.blob) + -len(writer.blob) % 4}]
    return _container(document, bytes(writer.blob))


def _nodes(skeleton: Skeleton) -> list[dict[str, Any]]:
    nodes = []
    for joint, (name, parent) in enumerate(zip(skeleton.names, skeleton.parents, strict=True)):
        origin = skeleton.positions[parent] if parent >= 0 else np.zeros(3)
        translation = np.round(skeleton.positions[joint] - origin, 7)
        children = [child for child, of in enumerate(skeleton.parents) if of == joint]
        node: dict[str, Any] = {"name": name, "translation": translation.tolist()}
        nodes.append(node | ({"children": children} if children else {}))
    return nodes


def _skin(writer: _Writer, skeleton: Skeleton, root: int) -> dict[str, Any]:
    inverse = np.tile(np.eye(4, dtype="<f4"), (len(skeleton.names), 1, 1))
    inverse[:, 3, :3] = -skeleton.positions  # column-major: the last row in memory is the translation
    accessor = writer.accessor(inverse)
    return {"inverseBindMatrices": accessor, "joints": list(range(len(skeleton.names))), "skeleton": root}


def _primitive(writer: _Writer, part: Part, material: int, shapes: tuple[str, ...]) -> dict[str, Any]:
    index_type = "<u2" if len(part.positions) < 65535 else "<u4"
    attributes = {
        "POSITION": writer.accessor(part.positions.astype("<f4"), ARRAY_BUFFER, bounds=True),
        "NORMAL": writer.accessor(_unit(part.normals), ARRAY_BUFFER),
        "TEXCOORD_0": writer.accessor(part.uv.astype("<f4"), ARRAY_BUFFER),
        "JOINTS_0": writer.accessor(part.joints.astype("u1"), ARRAY_BUFFER),
        "WEIGHTS_0": writer.accessor(_weights(part.weights), ARRAY_BUFFER),
    }
    indices = writer.accessor(part.triangles.astype(index_type).reshape(-1), ELEMENT_ARRAY_BUFFER)
    still = np.zeros((len(part.positions), 3), dtype=np.float32)
    targets = [{"POSITION": writer.sparse(part.shapes.get(shape, still).astype("<f4"))} for shape in shapes]
    return {"attributes": attributes, "indices": indices, "material": material, "targets": targets}


def _unit(normals: NDArray[np.float64]) -> NDArray[np.float32]:
    single = normals.astype("<f4")
    return np.asarray(single / np.linalg.norm(single, axis=1, keepdims=True), dtype="<f4")


def _weights(weights: NDArray[np.float64]) -> NDArray[np.float32]:
    single = weights.astype("<f4")
    return np.asarray(single / single.sum(axis=1, keepdims=True), dtype="<f4")


def _material(writer: _Writer, name: str, look: Look) -> None:
    document = writer.document
    kind = "image/png" if look.picture.startswith(b"\x89PNG") else "image/jpeg"
    document["images"].append({"name": name, "mimeType": kind, "bufferView": writer.view(look.picture)})
    document["textures"].append({"sampler": 0, "source": len(document["images"]) - 1})
    surface = {
        "baseColorTexture": {"index": len(document["textures"]) - 1},
        "metallicFactor": 0.0,
        "roughnessFactor": look.roughness,
    }
    document["materials"].append(
        {"name": name, "pbrMetallicRoughness": surface} | ({"doubleSided": True} if look.double_sided else {})
    )


def _container(document: dict[str, Any], blob: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":"), sort_keys=True).encode()
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    length = 12 + 8 + len(text) + 8 + len(blob)
    head = struct.pack("<4sII", b"glTF", 2, length)
    return head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
