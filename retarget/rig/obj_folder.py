"""A folder of OBJ files, one for the neutral face and one for each blend shape, as ICT-FaceKit has them.

All files list the same vertices in the same order; a shape is the difference to the neutral, which is the file with
"neutral" in its name. OBJ knows no unit: the mesh is scaled by 1, 1/100 or 1/1000, whichever makes it most nearly as
large as a head. Polygons become fans of triangles; materials and normals are left off.
Reference: Wavefront, Advanced Visualizer appendix B1 (object files).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from retarget.errors import InputError
from retarget.rig.fields import LARGEST
from retarget.rig.write_glb import MorphMesh

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MAX_FILE_BYTES = 200_000_000
MAX_FILES = 500
HEAD_M = 0.28
"""Height of a head with some neck."""
UNITS_M = (1.0, 0.01, 0.001)
STILL = 1e-6
"""A vertex that moves less than this part of the mesh's size is at rest."""


def read_obj_folder(folder: Path) -> MorphMesh:
    """The neutral mesh with its shapes, metres; InputError where the folder holds none, or where files differ."""
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() == ".obj")
    neutrals = [path for path in files if "neutral" in path.stem.lower()]
    if len(neutrals) != 1 or not 2 <= len(files) <= MAX_FILES:
        raise InputError(
            f"{folder} has {len(files)} OBJ files, {len(neutrals)} of them with 'neutral' in the name; one neutral and "
            f"one file for each of up to {MAX_FILES - 1} blend shapes are needed."
        )
    neutral = _read(neutrals[0])
    size = float(np.ptp(neutral.vertices, axis=0).max())
    unit = min(UNITS_M, key=lambda u: abs(np.log(max(u * size, 1e-12) / HEAD_M)))
    shapes = {}
    for path in files:
        if path != neutrals[0]:
            vertices = _vertices(path)
            if len(vertices) != len(neutral.vertices):
                raise InputError(
                    f"{path} has {len(vertices)} vertices and {neutrals[0].name} {len(neutral.vertices)}; export all "
                    "shapes from one mesh, vertices in one order."
                )
            offsets = vertices - neutral.vertices
            offsets[np.abs(offsets).max(axis=1) < STILL * size] = 0
            shapes[path.stem] = (unit * offsets).astype(np.float32)
    positions = (unit * neutral.vertices).astype(np.float32)
    return MorphMesh(folder.name or "face", positions, neutral.triangles, shapes)


class _Obj(NamedTuple):
    vertices: Array
    triangles: NDArray[np.int32]


def _read(path: Path) -> _Obj:
    vertices = _vertices(path)
    triangles = [triangle for line in _lines(path, "f") for triangle in _fan(path, line, len(vertices))]
    if not triangles:
        raise InputError(f"{path} has no faces; export the mesh with them.")
    return _Obj(vertices, np.array(triangles, np.int32))


def _vertices(path: Path) -> Array:
    """(V, 3)."""
    try:
        vertices = np.array([[float(x) for x in line[:3]] for line in _lines(path, "v")])
    except ValueError:
        vertices = np.zeros(0)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not (np.abs(vertices) < LARGEST).all():
        raise InputError(f"{path} has no vertices of three finite numbers each; export it again as OBJ.")
    return vertices


def _fan(path: Path, corners: list[str], count: int) -> list[tuple[int, int, int]]:
    """Triangles of a polygon; numbers count from 1, negative ones from the end."""
    try:
        given = [int(corner.split("/")[0]) for corner in corners]
    except ValueError:
        given = []
    numbers = [n - 1 if n > 0 else count + n for n in given]
    if len(numbers) < 3 or not all(0 <= n < count for n in numbers) or 0 in given:
        raise InputError(
            f"{path}: the face {' '.join(corners)[:60]!r} is not one of its {count} vertices; export again."
        )
    return [(numbers[0], numbers[k], numbers[k + 1]) for k in range(1, len(numbers) - 1)]


def _lines(path: Path, kind: str) -> list[list[str]]:
    """The words after `kind` of all such lines."""
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise InputError(f"{path} is too large for an OBJ file of a face, which may hold {MAX_FILE_BYTES} bytes.")
        with path.open(encoding="utf-8", errors="replace") as file:
            return [words[1:] for words in map(str.split, file) if words and words[0] == kind]
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
