"""C3D files: labels, unit, rate and gaps, read with ezc3d.

Gaps: a point with a negative residual, with a coordinate that is not finite, or at exactly (0, 0, 0) is NaN; C3D
writers use all three. Axes: where POINT:X_SCREEN and POINT:Y_SCREEN name two axes, the take is turned so that Y_SCREEN
becomes +Y, which is up, and X_SCREEN +X; where the file says nothing it is taken to be +Y up already. Points that the
file declares to be angles, forces, moments or powers are no markers and are left out. Source: The C3D File Format User
Guide (c3d.org).
"""

from __future__ import annotations

import json
import logging
import math
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget.errors import InputError
from retarget.frames import MarkerLayout
from retarget.markers.c3d_header import AGAIN, BLOCK, Header, read_header
from retarget.markers.clip import MarkerClip

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Parameters = Mapping[str, Sequence[Any]]

log = logging.getLogger("retarget.markers")

METRES = {
    "mm": 1e-3, "millimeter": 1e-3, "millimeters": 1e-3, "millimetre": 1e-3, "millimetres": 1e-3,
    "cm": 1e-2, "centimeter": 1e-2, "centimeters": 1e-2, "centimetre": 1e-2, "centimetres": 1e-2,
    "dm": 1e-1, "m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0,
    "in": 0.0254, "inch": 0.0254, "inches": 0.0254, "ft": 0.3048, "foot": 0.3048, "feet": 0.3048,
}  # fmt: skip
MAX_FILE_BYTES = 2_000_000_000
PARSE_SECONDS = 120
MOST_FRAMES = 0xFFFF
"""Where the frame numbers of a C3D header end."""
NOT_MARKERS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")
"""Parameters of POINT that list the names of points which are not places."""


def read_c3d(path: Path) -> MarkerClip:
    """The take in the C3D file at `path`.

    InputError where there is no such file, or it is no C3D file, damaged, cut short, without markers or in an unknown
    unit.
    """
    data = _bytes_of(path)
    header = read_header(path, data)
    point, points = _parse(path)
    seen = _seen_positions(path, points, header)
    labels, notes = unique_labels(_all_labels(point), seen.shape[1])
    notes += _frames_beyond(header, len(data), len(seen))
    for note in notes:
        log.warning("%s: %s", path.name, note)
    keep = _marker_columns(labels, point)
    if not keep:
        raise InputError(f"{path} holds no markers, only computed values such as joint angles.")
    positions = seen[:, keep] * _metres_per_unit(path, point) @ _world_axes(point).T
    layout = MarkerLayout(path.stem, tuple(labels[i] for i in keep))
    return MarkerClip(layout, _rate_hz(path, point), positions, path, header.first_frame, notes)


def unique_labels(labels: list[str], points: int) -> tuple[list[str], tuple[str, ...]]:
    """One name for each of `points` points, and a sentence on every name that had to be made up.

    Empty names become ``point 7``, counted from 1; of several equal names the second becomes ``name (2)``.
    """
    names: list[str] = []
    notes: list[str] = []
    taken = {label.strip() for label in labels}
    for i in range(points):
        label = labels[i].strip() if i < len(labels) else ""
        name, count = label or f"point {i + 1}", 1
        while name in names or (count > 1 and name in taken):
            count += 1
            name = f"{label} ({count})"
        if name != label:
            notes.append(f"Point {i + 1} is named {label!r} in the file; here it is {name!r}.")
        names.append(name)
    return names, tuple(notes)


def _bytes_of(path: Path) -> bytes:
    try:
        size = path.stat().st_size
        if size > MAX_FILE_BYTES:
            raise InputError(f"{path} is too large: {size} bytes; at most {MAX_FILE_BYTES} can be read.")
        return path.read_bytes()
    except FileNotFoundError as error:
        raise InputError(f"There is no file {path}.") from error
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}.") from error


def _parse(path: Path) -> tuple[Parameters, Array]:
    """The parameters of POINT and the points (4, M, N), as ezc3d reads them: NaN where the residual is negative."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "take.npz"
        command = [sys.executable, "-P", str(Path(__file__).with_name("c3d_parse.py")), str(path), str(target)]
        try:
            run = subprocess.run(command, capture_output=True, text=True, timeout=PARSE_SECONDS, check=False)  # noqa: S603
        except subprocess.TimeoutExpired as error:
            raise InputError(f"{path} cannot be read: parsing it took more than {PARSE_SECONDS} s. {AGAIN}") from error
        if run.returncode != 0:
            reason = run.stderr.strip().rpartition("\n")[2].rstrip(" .") or "it cannot be parsed"
            raise InputError(f"{path} is damaged: {reason}. {AGAIN}")
        with np.load(target, allow_pickle=False) as parsed:
            return json.loads(parsed["point"].item()), parsed["points"]


def _seen_positions(path: Path, points: Array, header: Header) -> Array:
    """(N, M, 3) in the file's unit and axes, NaN where not seen."""
    if points.ndim != 3 or 0 in points.shape:
        raise InputError(f"{path} holds no frames of points; expected a C3D file with markers.")
    if points.shape[2] < header.frames:
        count = f"it should hold {header.frames} frames, but holds {points.shape[2]}"
        raise InputError(f"{path} is cut short: {count}. Copy it again.")
    positions = points[:3].transpose(2, 1, 0).astype(float, order="C")
    unseen = ~np.isfinite(positions).all(-1) | (positions == 0).all(-1)
    positions[unseen] = np.nan
    return positions


def _frames_beyond(header: Header, file_bytes: int, frames: int) -> tuple[str, ...]:
    """A sentence where the file goes on after the last frame that the library reads."""
    left = file_bytes - (header.data_block - 1) * BLOCK - frames * header.frame_bytes
    if frames < MOST_FRAMES or left < max(BLOCK, header.frame_bytes):
        return ()
    return (f"The take goes on after frame {frames - 1}, but no more are read; export it in shorter pieces.",)


def _all_labels(point: Parameters) -> list[str]:
    """LABELS, LABELS2, ...: a C3D parameter holds 255 names at most."""
    labels: list[str] = []
    number = 1
    while (key := "LABELS" if number == 1 else f"LABELS{number}") in point:
        labels += _texts(point, key)
        number += 1
    return labels


def _marker_columns(labels: list[str], point: Parameters) -> list[int]:
    computed = {name for key in NOT_MARKERS for name in _texts(point, key)}
    return [i for i, label in enumerate(labels) if label not in computed]


def _texts(point: Parameters, key: str) -> list[str]:
    return [str(value).strip() for value in point.get(key, ())]


def _metres_per_unit(path: Path, point: Parameters) -> float:
    unit = next(iter(_texts(point, "UNITS")), "")
    if unit.casefold() not in METRES:
        raise InputError(
            f"{path} gives its positions in the unit {unit!r}; expected one of mm, cm, dm, m, in or ft in POINT:UNITS."
        )
    return METRES[unit.casefold()]


def _rate_hz(path: Path, point: Parameters) -> float:
    rate = float(next(iter(point.get("RATE", ())), math.nan))
    if not (math.isfinite(rate) and rate > 0):
        raise InputError(f"{path} does not say how many frames a second it has: POINT:RATE is {rate:g}.")
    return rate


def _world_axes(point: Parameters) -> Array:
    """R_world_file (3, 3) from the screen axes; the identity where the file does not give two different ones."""
    right, up = (_axis(next(iter(_texts(point, key)), "")) for key in ("X_SCREEN", "Y_SCREEN"))
    if right is None or up is None or right @ up != 0:
        return np.eye(3)
    return np.array([right, up, np.cross(right, up)])


def _axis(text: str) -> Array | None:
    """Unit vector of an axis such as "+Z"; None for anything else."""
    name = text.upper().lstrip("+-")
    if name not in ("X", "Y", "Z"):
        return None
    axis = np.zeros(3)
    axis["XYZ".index(name)] = -1.0 if text.startswith("-") else 1.0
    return axis
