"""The average face that comes with MediaPipe's mesh: one vertex for each of its first 468 points, and which are rigid.

The file is a protocol buffer of the face geometry pipeline (Apache-2.0): field 1 the mesh, in which field 3 holds five
floats a vertex (x, y, z in centimetres, then texture coordinates); field 2, repeated, the number and the weight of a
vertex to align faces by. Axes are the house's: +X to the performer's left, +Y up, +Z out of the face.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.camera.models import model_path
from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

VERTICES = 468
_FLOATS_A_VERTEX = 5
_METRES = 0.01
_VARINT, _LENGTH, _FLOAT = 0, 2, 5  # wire types


@dataclass(frozen=True, slots=True, eq=False)
class CanonicalFace:
    """An average face in metres; its eyes' outer corners are 89 mm apart."""

    points: Array
    """(468, 3) [m], origin between the ears behind the nose's bridge."""
    weights: Array
    """(468,) how rigid, and how well seen, each point is; 0 for most."""


def load_canonical_face() -> CanonicalFace:
    """The model face_geometry; InputError where it is not on this machine or holds something else."""
    path = model_path("face_geometry")
    return parse_canonical_face(path.read_bytes(), str(path))


def parse_canonical_face(content: bytes, name: str) -> CanonicalFace:
    """The face in the bytes of the file `name`; InputError where they hold something else."""
    try:
        fields = list(_fields(content))
        mesh = b"".join(value for number, value in _fields(_bytes_of(fields, 1)[0]) if number == 3)
        vertices = np.frombuffer(mesh, "<f4").reshape(VERTICES, _FLOATS_A_VERTEX).astype(float)
        weights = np.zeros(VERTICES)
        for entry in _bytes_of(fields, 2):
            basis = dict(_fields(entry))
            weights[int.from_bytes(basis[1], "little")] = np.frombuffer(basis[2], "<f4")[0]
    except (ValueError, IndexError, KeyError) as error:
        raise InputError(f"{name} is not the geometry of a face mesh of {VERTICES} points.") from error
    return CanonicalFace(vertices[:, :3] * _METRES, weights)


def _bytes_of(fields: list[tuple[int, bytes]], number: int) -> list[bytes]:
    return [value for field, value in fields if field == number]


def _fields(message: bytes) -> Iterator[tuple[int, bytes]]:
    """Numbers and contents of a message's fields; integers as eight little-endian bytes."""
    at = 0
    while at < len(message):
        key, at = _varint(message, at)
        if key & 7 == _VARINT:
            value, at = _varint(message, at)
            yield key >> 3, value.to_bytes(8, "little")
            continue
        size = 4
        if key & 7 == _LENGTH:
            size, at = _varint(message, at)
        elif key & 7 != _FLOAT:
            raise ValueError("a wire type that such files do not use")
        if at + size > len(message):
            raise ValueError("cut short")
        yield key >> 3, message[at : at + size]
        at += size


def _varint(message: bytes, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 63, 7):
        value |= (message[at] & 127) << shift
        at += 1
        if message[at - 1] < 128:
            return value, at
    raise ValueError("a number without end")
