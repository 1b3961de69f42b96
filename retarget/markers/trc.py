"""TRC files (Track Row Column, Motion Analysis): names, unit, rate, first frame and gaps, read and written.

Five lines of header (kind of file; names of fields; their values; marker names, one for three columns; X1 Y1 Z1 ...),
often an empty line, then a row a frame: number, time [s], coordinates, divided by tabs. A marker that was not seen has
empty cells; "nan" and a position at exactly (0, 0, 0), which other writers leave there, count as not seen too. The
format does not tell which axis is up; +Y is taken to be. Source: files of Cortex, Motive and OpenSim.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from retarget.errors import InputError
from retarget.frames import MarkerLayout
from retarget.markers import table
from retarget.markers.c3d import unique_labels
from retarget.markers.clip import MarkerClip

if TYPE_CHECKING:
    from pathlib import Path

MAX_MARKERS: Final = 10_000
_FIELDS: Final = (
    "DataRate",
    "CameraRate",
    "NumFrames",
    "NumMarkers",
    "Units",
    "OrigDataRate",
    "OrigDataStartFrame",
    "OrigNumFrames",
)
_HEADER_LINES: Final = 5
_FIRST_MARKER_COLUMN: Final = 2


def read_trc(path: Path) -> MarkerClip:
    """The take in the TRC file at `path`; what had to be decided is in its notes.

    InputError where there is no such file, or it is empty, no TRC file, cut before its first frame or in an unknown
    unit.
    """
    text = table.read_text(path)
    lines = text.split("\n")
    if not text.strip():
        raise InputError(f"{path} is empty; expected a TRC file")
    if not lines[0].startswith("PathFileType"):
        raise InputError(f"{path} is no TRC file: it does not start with 'PathFileType'")
    fields = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False)) if len(lines) > _HEADER_LINES else {}
    names = _names(path, fields, lines)
    rows = [line.split("\t") for line in lines[_HEADER_LINES:] if line.strip()]
    told = table.number(fields.get("NumFrames", ""))
    if rows and not text.endswith("\n") and (len(rows) < told or len(rows[-1]) < _FIRST_MARKER_COLUMN + 3 * len(names)):
        rows.pop()  # every whole row ends with a line break
    if not rows:
        raise InputError(f"{path} is cut before the first whole frame; export it again")
    positions = table.positions_from(rows, range(_FIRST_MARKER_COLUMN, _FIRST_MARKER_COLUMN + 3 * len(names), 3))
    positions[(positions == 0).all(axis=2)] = np.nan
    numbers = [table.number(row[0]) for row in rows]
    times = np.array([table.number(row[1]) for row in rows])
    first, positions, gaps = table.by_number(numbers, positions)
    unique, renamed = unique_labels(names, len(names))
    return MarkerClip(
        layout=MarkerLayout(path.stem, tuple(unique)),
        rate_hz=table.rate_from(path, [table.number(fields.get("DataRate", ""))], times),
        positions=positions * table.metres_per_unit(path, fields.get("Units", "")),
        source=path,
        first_frame=first,
        notes=(*renamed, *gaps, *table.shortness(len(rows), told)),
    )


def write_trc(path: Path, clip: MarkerClip) -> None:
    """Write `clip` as TRC, in millimetres, gaps as empty cells. Raises OSError, and InputError for names with tabs."""
    names = clip.layout.names
    if any(set(name) & {"\t", "\n", "\r"} for name in names):
        raise InputError("A marker's name with a tab or a line break in it cannot stand in a TRC file; rename it")
    rate, count = f"{clip.rate_hz:.10g}", str(len(clip))
    values = (rate, rate, count, str(len(names)), "mm", rate, str(clip.first_frame), count)
    columns = "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, len(names) + 1))
    with path.open("w", encoding="utf-8", newline="\r\n") as file:
        file.write(f"PathFileType\t4\t(X/Y/Z)\t{path.name}\n")
        file.write("\t".join(_FIELDS) + "\n" + "\t".join(values) + "\n")
        file.write("Frame#\tTime\t" + "".join(f"{name}\t\t\t" for name in names) + f"\n\t\t{columns}\n\n")
        for i, positions in enumerate(clip.positions * 1e3):
            cells = [f"{value:.6f}" if value == value else "" for value in positions.ravel().tolist()]
            file.write(f"{clip.first_frame + i}\t{i / clip.rate_hz:.6f}\t" + "\t".join(cells) + "\n")


def _names(path: Path, fields: dict[str, str], lines: list[str]) -> list[str]:
    """One name per marker, "" where the file has none."""
    count = table.number(fields.get("NumMarkers", ""))
    if not 0 < count <= MAX_MARKERS or not lines[3].startswith("Frame#"):
        raise InputError(f"{path} is cut within the header of a TRC file, or damaged there; export it again")
    names = lines[3].split("\t")[_FIRST_MARKER_COLUMN::3][: int(count)]
    return [*names, *[""] * (int(count) - len(names))]
