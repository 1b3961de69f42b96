"""The GLB container and its accessors: bytes to a glTF document and numpy arrays.

A GLB is a 12-byte header, a JSON chunk and one binary chunk, all little-endian. Everything a count or an offset points
at is checked against the bytes that are there, so that a broken file ends in `InputError`.
Reference: Khronos glTF 2.0 specification, sections 3.6 (buffers, accessors) and 4 (GLB).
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget.errors import InputError
from retarget.rig.fields import Fields

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}

SHAPES = {
    "SCALAR": (1, 1),
    "VEC2": (1, 2),
    "VEC3": (1, 3),
    "VEC4": (1, 4),
    "MAT2": (2, 2),
    "MAT3": (3, 3),
    "MAT4": (4, 4),
}
"""Columns and rows of one element."""

COMPRESSION = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization", "KHR_texture_basisu")
"""Required extensions that an exporter can be told to leave off."""

HARMLESS = ("KHR_materials_", "KHR_lights_", "VRM")
"""Beginnings of required extensions without which the mesh still is where it should be."""

DAMAGED = "the file is damaged, export it again"
"""End of messages about what no exporter writes."""


@dataclass(frozen=True, slots=True, eq=False)
class Glb:
    """An open GLB: its document and its binary chunk."""

    path: Path
    document: Fields
    binary: bytes

    def entry(self, kind: str, index: int) -> Fields:
        """The object `document[kind][index]`; InputError where there is none."""
        entries = self.document.data.get(kind, [])
        if not isinstance(entries, list):
            raise self.document.wrong(kind, "a list")
        if index >= len(entries):
            raise InputError(f"{self.path.name}: {kind}[{index}] is used, but the file has {len(entries)} {kind}.")
        return Fields(entries[index], f"{self.path.name}, {kind}[{index}]")

    def view(self, index: int) -> tuple[memoryview, int]:
        """The bytes of a buffer view and its byteStride, 0 where it has none."""
        view = self.entry("bufferViews", index)
        buffer = view.integer("buffer")
        if buffer != 0 or "uri" in self.entry("buffers", 0):
            raise InputError(
                f"{self.path.name} keeps data outside its binary chunk; export it as one GLB with everything inside."
            )
        start, length = view.integer("byteOffset", 0), view.integer("byteLength")
        if start + length > len(self.binary):
            raise InputError(
                f"{view.place} ends at byte {start + length} of the {len(self.binary)} there are; {DAMAGED}."
            )
        return memoryview(self.binary)[start : start + length], view.integer("byteStride", 0)

    def array(self, index: int) -> NDArray[Any]:
        """An accessor's values: (N,) for SCALAR, (N, n) for VECn, (N, n, n) with rows first for MATn.

        Integers marked normalised become float32 in [0, 1] or [-1, 1]; others keep their type. Sparse
        values are filled in.
        """
        accessor = self.entry("accessors", index)
        count = accessor.integer("count")
        dtype, shape = _dtype(accessor), _shape(accessor)
        if "bufferView" in accessor:
            values = self._strided(accessor, dtype, shape, count)
        elif count <= len(self.binary):  # such an accessor takes no bytes, so nothing else would bound it
            values = np.zeros((count, *shape), dtype)
        else:
            raise InputError(f"{accessor.place} counts {count} elements of zeros, more than the file has bytes.")
        if "sparse" in accessor:
            values = self._with_sparse(accessor.table("sparse"), values)
        values = _normalised(values) if accessor.flag("normalized") else values
        return np.swapaxes(values, 1, 2) if shape[0] > 1 else values[:, 0, 0] if shape[1] == 1 else values[:, 0]

    def _strided(self, fields: Fields, dtype: np.dtype[Any], shape: tuple[int, int], count: int) -> NDArray[Any]:
        """(N, columns, rows), a view into the binary chunk."""
        data, given_stride = self.view(fields.integer("bufferView"))
        start = fields.integer("byteOffset", 0)
        columns, rows = shape
        # Matrix columns begin on multiples of four bytes (section 3.6.2.4).
        column = -(-rows * dtype.itemsize // 4) * 4 if columns > 1 else rows * dtype.itemsize
        stride = given_stride or columns * column
        used = (columns - 1) * column + rows * dtype.itemsize
        end = start + (count - 1) * stride + used if count else start
        if stride < used or end > len(data):
            raise InputError(
                f"{fields.place} asks for {count} elements up to byte {end} of the {len(data)} there are; {DAMAGED}."
            )
        strides = (stride, column, dtype.itemsize)
        return (
            np.ndarray((count, columns, rows), dtype, data, start, strides) if count else np.zeros((0, *shape), dtype)
        )

    def _with_sparse(self, sparse: Fields, values: NDArray[Any]) -> NDArray[Any]:
        count = sparse.integer("count")
        at_fields = sparse.table("indices")
        at = self._strided(at_fields, _dtype(at_fields), (1, 1), count)[:, 0, 0]
        if at.dtype.kind != "u" or (count and int(at.max()) >= len(values)):
            raise InputError(f"{sparse.place} replaces an element beyond the {len(values)} there are; {DAMAGED}.")
        filled = values.copy()
        filled[at] = self._strided(sparse.table("values"), values.dtype, (values.shape[1], values.shape[2]), count)
        return filled


def read_glb(path: Path) -> Glb:
    """Opens a GLB file; InputError where it is none, is cut short, or needs what this reader does not have."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"The mesh file {str(path)!r} cannot be read: {error.strerror or error}.") from error
    _check_header(path, data)
    chunks = _chunks(path, data)
    if JSON_CHUNK not in chunks:
        raise InputError(f"{path.name} holds no JSON chunk, so it is not a GLB that can be read; export it again.")
    try:
        document = Fields(json.loads(chunks[JSON_CHUNK]), path.name)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path.name}: its JSON chunk cannot be read ({error}); export it again.") from error
    _check_extensions(document)
    return Glb(path, document, chunks.get(BINARY_CHUNK, b""))


def _check_header(path: Path, data: bytes) -> None:
    if data[:4] != b"glTF":
        raise InputError(
            f"{str(path)!r} is not a GLB: it does not begin with 'glTF'. Export the rig as glTF 2.0 binary (.glb)."
        )
    if len(data) < 12:
        raise InputError(
            f"{str(path)!r} is cut short: 12 bytes are expected and {len(data)} are there; copy or export it again."
        )
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise InputError(
            f"{str(path)!r} is a GLB of version {version}; only version 2 can be read. Export it as glTF 2.0."
        )
    if length > len(data):
        raise InputError(
            f"{str(path)!r} is cut short: {length} bytes are expected, {len(data)} are there; copy or export it again."
        )


def _chunks(path: Path, data: bytes) -> dict[int, bytes]:
    """The first chunk of every type; chunks of unknown types are allowed and left alone (section 4.4)."""
    end = struct.unpack_from("<I", data, 8)[0]
    chunks: dict[int, bytes] = {}
    at = 12
    while at + 8 <= end:
        length, kind = struct.unpack_from("<II", data, at)
        if at + 8 + length > end:
            raise InputError(f"{path.name}: a chunk announces {length} bytes and {end - at - 8} are there; {DAMAGED}.")
        chunks.setdefault(kind, data[at + 8 : at + 8 + length])
        at += 8 + length
    return chunks


def _check_extensions(document: Fields) -> None:
    for name in document.texts("extensionsRequired"):
        if name in COMPRESSION:
            raise InputError(
                f"{document.place} is compressed by {name}, which cannot be read; export it again uncompressed."
            )
        if not name.startswith(HARMLESS):
            raise InputError(
                f"{document.place} requires the extension {name}, which cannot be read; export it again without it."
            )


def _dtype(fields: Fields) -> np.dtype[Any]:
    kind = fields.integer("componentType")
    if kind not in COMPONENTS:
        raise fields.wrong("componentType", f"one of {', '.join(map(str, COMPONENTS))}")
    return np.dtype(COMPONENTS[kind])


def _shape(accessor: Fields) -> tuple[int, int]:
    kind = accessor.text("type")
    if kind not in SHAPES:
        raise accessor.wrong("type", f"one of {', '.join(SHAPES)}")
    return SHAPES[kind]


def _normalised(values: NDArray[Any]) -> NDArray[Any]:
    if values.dtype.kind not in "iu":
        return values
    scaled = values.astype(np.float32) / np.float32(np.iinfo(values.dtype).max)
    return scaled.clip(-1.0, 1.0)  # the lowest signed value has no positive twin
