"""A mesh with blend shapes as one GLB without a skin: what imports of other formats become, so that a rig has one form.

A root node `head` carries the mesh. Reference: glTF 2.0, sections 3.6.2.3 (sparse accessors), 3.7.2.2 (morph targets),
4.4 (GLB).
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget.rig.glb import BINARY_CHUNK, JSON_CHUNK

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

HEAD = "head"
_FLOAT, _UINT = 5126, 5125
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}


@dataclass(frozen=True, slots=True, eq=False)
class MorphMesh:
    """A neutral mesh and its blend shapes."""

    name: str
    positions: NDArray[np.float32]
    """(V, 3) [m]."""
    triangles: NDArray[np.int32]
    """(F, 3)."""
    shapes: Mapping[str, NDArray[np.float32]]
    """Offsets (V, 3) [m] at weight 1."""
    uv: NDArray[np.float32] | None = None
    """(V, 2), origin in the upper left."""


@dataclass(slots=True)
class _Buffer:
    views: list[dict[str, int]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    data: bytearray = field(default_factory=bytearray)

    def view(self, values: NDArray[Any]) -> int:
        """Values of four bytes each, so that all stays aligned."""
        data = values.tobytes()
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)})
        self.data += data
        return len(self.views) - 1

    def accessor(self, values: NDArray[Any]) -> int:
        bounds = {"min": values.min(0).tolist(), "max": values.max(0).tolist()} if values.ndim == 2 else {}
        return self._add(values, bufferView=self.view(values), **bounds)

    def sparse(self, values: NDArray[Any]) -> int:
        moved = np.flatnonzero(values.any(axis=1))
        bounds = {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
        if not len(moved):
            return self._add(values, **bounds)
        indices = {"bufferView": self.view(moved.astype("<u4")), "componentType": _UINT}
        kept = {"bufferView": self.view(values[moved])}
        return self._add(values, sparse={"count": len(moved), "indices": indices, "values": kept}, **bounds)

    def _add(self, values: NDArray[Any], **fields: Any) -> int:
        kind = _KINDS[1 if values.ndim == 1 else values.shape[1]]
        component = _FLOAT if values.dtype.kind == "f" else _UINT
        self.accessors.append({"componentType": component, "count": len(values), "type": kind} | fields)
        return len(self.accessors) - 1


def glb_bytes(mesh: MorphMesh) -> bytes:
    """The file; the same mesh gives the same bytes."""
    buffer = _Buffer()
    attributes = {"POSITION": buffer.accessor(mesh.positions.astype("<f4"))}
    if mesh.uv is not None:
        attributes["TEXCOORD_0"] = buffer.accessor(mesh.uv.astype("<f4"))
    primitive = {
        "attributes": attributes,
        "indices": buffer.accessor(mesh.triangles.ravel().astype("<u4")),
        "targets": [{"POSITION": buffer.sparse(offsets.astype("<f4"))} for offsets in mesh.shapes.values()],
    }
    document = {
        "asset": {"version": "2.0", "generator": "retarget rigs add"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": HEAD, "children": [1]}, {"name": mesh.name, "mesh": 0}],
        "meshes": [{"name": mesh.name, "primitives": [primitive], "extras": {"targetNames": list(mesh.shapes)}}],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    return _container(json.dumps(document, separators=(",", ":")).encode(), bytes(buffer.data))


def _container(text: bytes, data: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data))
    return b"".join(
        (head, struct.pack("<II", len(text), JSON_CHUNK), text, struct.pack("<II", len(data), BINARY_CHUNK), data)
    )
