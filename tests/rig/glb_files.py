"""GLB files made by an independent writer, pygltflib, and what glTF 2.0 says of them, computed one vertex at a time."""

from __future__ import annotations

import json
import struct
from typing import TYPE_CHECKING, Any

import numpy as np
import pygltflib as g

from retarget.rig.glb import read_glb
from retarget.rig.nodes import read_nodes, read_skeleton
from retarget.rig.surfaces import read_surfaces

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from retarget.rig.model import Joints, Surface

    Array = NDArray[np.float64]

COMPONENT = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TRIANGLE = np.array([[0, 1, 2]], np.uint16)
KIND = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}


class GlbFile:
    """A document that grows; `save` writes it."""

    def __init__(self) -> None:
        self.gltf = g.GLTF2(scene=0, scenes=[g.Scene(nodes=[])])
        self.blob = b""

    def view(self, data: bytes, stride: int | None = None) -> int:
        self.blob += bytes(-len(self.blob) % 4)
        self.gltf.bufferViews.append(
            g.BufferView(buffer=0, byteOffset=len(self.blob), byteLength=len(data), byteStride=stride)
        )
        self.blob += data
        return len(self.gltf.bufferViews) - 1

    def accessor(self, values: NDArray[Any], **changes: Any) -> int:
        """Tightly packed, matrices column by column; `changes` are fields of the accessor."""
        data = np.swapaxes(values, -1, -2) if values.ndim == 3 else values
        fields = {
            "bufferView": self.view(data.astype(data.dtype.newbyteorder("<")).tobytes()),
            "componentType": COMPONENT[values.dtype.str[1:]],
            "type": KIND[values.shape[1:]],
            "count": len(values),
        }
        return self.add_accessor(**(fields | changes))

    def add_accessor(self, **fields: Any) -> int:
        self.gltf.accessors.append(g.Accessor(**fields))
        return len(self.gltf.accessors) - 1

    def sparse(self, at: NDArray[Any], values: NDArray[Any], count: int, base: int | None = None) -> int:
        """An accessor of `count` elements that replaces those `at` by `values`; zeros or the view `base` elsewhere."""
        indices = g.AccessorSparseIndices(bufferView=self.view(at.tobytes()), componentType=COMPONENT[at.dtype.str[1:]])
        replacing = g.AccessorSparseValues(bufferView=self.view(values.tobytes()))
        return self.add_accessor(
            bufferView=base,
            componentType=COMPONENT[values.dtype.str[1:]],
            type=KIND[values.shape[1:]],
            count=count,
            sparse=g.Sparse(count=len(at), indices=indices, values=replacing),
        )

    def node(self, parent: int | None = None, **fields: Any) -> int:
        self.gltf.nodes.append(g.Node(**fields))
        n = len(self.gltf.nodes) - 1
        (self.gltf.scenes[0].nodes if parent is None else self.gltf.nodes[parent].children).append(n)
        return n

    def mesh(self, positions: NDArray[Any], triangles: NDArray[Any], names: tuple[str, ...] = (), **fields: Any) -> int:
        """One primitive with the accessors `fields` as attributes; `targets` and `material` belong to the primitive."""
        targets = [g.Attributes(POSITION=t) for t in fields.pop("targets", ())]
        primitive = g.Primitive(
            indices=self.accessor(triangles.ravel()), targets=targets or None, material=fields.pop("material", None)
        )
        primitive.attributes = g.Attributes(POSITION=self.accessor(positions), **fields)
        extras = {"targetNames": list(names)} if names else {}
        self.gltf.meshes.append(g.Mesh(primitives=[primitive], extras=extras))
        return len(self.gltf.meshes) - 1

    def skin(self, joints: list[int], inverse_bind: Array | None = None) -> int:
        given = None if inverse_bind is None else self.accessor(inverse_bind.astype(np.float32))
        self.gltf.skins.append(g.Skin(joints=joints, inverseBindMatrices=given))
        return len(self.gltf.skins) - 1

    def save(self, path: Path) -> Path:
        if self.blob:
            self.gltf.buffers = [g.Buffer(byteLength=len(self.blob))]
            self.gltf.set_binary_blob(self.blob)
        self.gltf.save_binary(str(path))
        return path


def two_joint_file() -> GlbFile:
    """A square in the plane z = 0 whose lower half hangs on a jaw; one blend shape, all by plain float accessors."""
    file = GlbFile()
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)
    triangles = np.array([[0, 1, 2], [2, 1, 3]], np.uint16)
    mesh = file.mesh(
        positions,
        triangles,
        ("mouthOpen",),
        JOINTS_0=file.accessor(np.array([[1, 0, 0, 0]] * 2 + [[0, 0, 0, 0]] * 2, np.uint8)),
        WEIGHTS_0=file.accessor(np.array([[1, 0, 0, 0]] * 4, np.float32)),
        targets=[file.accessor(np.array([[0, -0.1, 0]] * 2 + [[0, 0, 0]] * 2, np.float32))],
    )
    head = file.node(name="head", translation=[0.0, 1.0, 0.0])
    jaw = file.node(head, name="jaw", translation=[0.0, -0.5, 0.0])
    inverse_bind = np.tile(np.eye(4), (2, 1, 1))
    inverse_bind[:, 1, 3] = [-1.0, -0.5]
    file.node(name="face", mesh=mesh, skin=file.skin([head, jaw], inverse_bind))
    return file


def rewrite_json(glb: bytes, change: Any) -> bytes:
    """The GLB with `change` applied to its document, which it may alter or replace."""
    length = struct.unpack_from("<I", glb, 12)[0]
    document = json.loads(glb[20 : 20 + length])
    text = json.dumps(change(document) or document).encode()
    text += b" " * (-len(text) % 4)
    rest = glb[20 + length :]
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


def read_mesh(path: Path, *named: str) -> tuple[Joints, tuple[Surface, ...], tuple[str, ...]]:
    """Joints, surfaces and names of the shapes; `named` nodes are joints too."""
    glb = read_glb(path)
    nodes = read_nodes(glb)
    skeleton = read_skeleton(glb, nodes, named)
    surfaces, names = read_surfaces(glb, nodes, skeleton)
    return skeleton.joints(), surfaces, names
