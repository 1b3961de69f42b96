"""CSV files of tracking data as Motive exports them (format versions 1.2 and later), read and written.

The first line holds names and values in turn: format version, take name, frame rates, length unit. After an empty line
come the columns' type, name, ID, (parent) and kind, then "Frame,Time (Seconds),X,Y,Z,..." and a row a frame. Measured
markers have the type "Marker"; where a file has none, the solved positions of rigid bodies' or bones' markers are
taken. Columns of unlabelled markers are left out, as each holds whatever the camera system could not name. A marker
that was not seen has empty cells. Source: OptiTrack's documentation of data export, and files of Motive 1.10 to 3.
"""

from __future__ import annotations

import csv
import math
import uuid
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from retarget.errors import InputError
from retarget.frames import MarkerLayout
from retarget.markers import table
from retarget.markers.c3d import unique_labels
from retarget.markers.clip import MarkerClip

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

MARKER_TYPES: Final = ("Marker", "Rigid Body Marker", "Bone Marker", "Marker Set Marker")
"""Types of columns that are taken, the first that the file has."""
_MOST_HEADER_LINES: Final = 20
_UNLABELLED: Final = "Unlabeled"
_SEED: Final = uuid.UUID("6f2a1c1e-6d0b-4b9a-9d0e-3d2f5a7c9b10")


class _Header(NamedTuple):
    values: dict[str, str]
    """Of the first line."""
    rows: list[list[str]]
    """The lines between the first and the axes: type, name and so on."""
    axes: list[str]
    """The line "Frame,Time (Seconds),X,Y,Z,..."."""


def read_motive_csv(path: Path) -> MarkerClip:
    """The take in the file at `path`; what had to be decided is in its notes.

    InputError where there is no such file, or it is empty, not Motive's, without markers or in an unknown unit.
    """
    text = table.read_text(path)
    if not text.strip():
        raise InputError(f"{path} is empty; expected a CSV file exported from Motive")
    lines = text.split("\n")
    try:
        header, start = _header(path, lines)
        body = list(csv.reader(lines[start:]))
    except csv.Error as error:
        raise InputError(f"{path} is damaged: {error}; export it again") from error
    names, columns, left_out = _columns(path, header)
    rows = [row for row in body if row and math.isfinite(table.number(row[0]))]
    if rows and not text.endswith("\n") and len(rows[-1]) < len(header.axes):
        rows.pop()  # every whole row ends with a line break
    if not rows:
        raise InputError(f"{path} holds no frames; export it again")
    positions = table.positions_from(rows, columns)
    times = np.array([table.number(row[1]) if len(row) > 1 else math.nan for row in rows])
    first, positions, gaps = table.by_number([table.number(row[0]) for row in rows], positions)
    unique, renamed = unique_labels(names, len(names))
    told = table.number(header.values.get("Total Exported Frames", ""))
    rates = [table.number(header.values.get(f"{kind} Frame Rate", "")) for kind in ("Export", "Capture")]
    return MarkerClip(
        layout=MarkerLayout(path.stem, tuple(unique)),
        rate_hz=table.rate_from(path, rates, times),
        positions=positions * table.metres_per_unit(path, header.values.get("Length Units", "")),
        source=path,
        first_frame=first,
        notes=(*renamed, *gaps, *left_out, *table.shortness(len(rows), told)),
    )


def write_motive_csv(path: Path, clip: MarkerClip) -> None:
    """Write `clip` with Motive's header, in metres, gaps as empty cells. Raises OSError."""
    names, rate = clip.layout.names, f"{clip.rate_hz:.6f}"
    count = str(len(clip))
    values = {
        "Format Version": "1.23",
        "Take Name": clip.source.stem,
        "Take Notes": "",
        "Capture Frame Rate": rate,
        "Export Frame Rate": rate,
        "Total Frames in Take": count,
        "Total Exported Frames": count,
        "Rotation Type": "Quaternion",
        "Length Units": "Meters",
        "Coordinate Space": "Global",
    }
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\r\n")
        writer.writerow([cell for pair in values.items() for cell in pair])
        writer.writerow([])
        writer.writerow(["", "Type", *_thrice("Marker" for _ in names)])
        writer.writerow(["", "Name", *_thrice(iter(names))])
        writer.writerow(["", "ID", *_thrice(uuid.uuid5(_SEED, name).hex.upper() for name in names)])
        writer.writerow(["", "", *_thrice("Position" for _ in names)])
        writer.writerow(["Frame", "Time (Seconds)", *"XYZ" * len(names)])
        for i, positions in enumerate(clip.positions):
            cells = [f"{value:.9f}" if value == value else "" for value in positions.ravel().tolist()]
            writer.writerow([clip.first_frame + i, f"{i / clip.rate_hz:.6f}", *cells])


def _header(path: Path, lines: list[str]) -> tuple[_Header, int]:
    """(the header, number of its lines)."""
    rows = list(csv.reader(lines[:_MOST_HEADER_LINES]))
    first = rows[0] if rows else []
    if not first or first[0].strip() != "Format Version":
        raise InputError(f"{path} is no CSV file exported from Motive: it does not start with 'Format Version'")
    for i, row in enumerate(rows):
        if len(row) > 1 and row[0].strip() == "Frame" and row[1].startswith("Time"):
            values = dict(zip((cell.strip() for cell in first[::2]), first[1::2], strict=False))
            return _Header(values, [other for other in rows[1:i] if any(other)], row), i + 1
    raise InputError(f"{path} has no line of columns ('Frame,Time (Seconds),...'); export it again with headers")


def _columns(path: Path, header: _Header) -> tuple[list[str], list[int], tuple[str, ...]]:
    """(name of each marker, column of its X, what was left out)."""
    types = next((row for row in header.rows if set(row) & set(MARKER_TYPES)), [])
    kind = next((kind for kind in MARKER_TYPES if kind in types), None)
    if kind is None:
        raise InputError(f"{path} holds no markers; export it from Motive with 'Markers' switched on")
    below = header.rows[header.rows.index(types) + 1 :]
    marker_names = next((row for row in below if len(row) > 1 and row[1].strip() in ("Name", "")), [])
    found = [
        (marker_names[i].strip() if i < len(marker_names) else "", i)
        for i, axes in _triples(header.axes)
        if i < len(types) and types[i] == kind and axes == "XYZ" and _is_position(header, i)
    ]
    named = [(name, column) for name, column in found if not name.startswith(_UNLABELLED)]
    if not named:
        raise InputError(f"{path} holds no named markers, only {len(found)} unlabelled ones")
    notes = []
    if len(named) < len(found):
        notes.append(f"{len(found) - len(named)} columns of unlabelled markers are left out.")
    if kind != MARKER_TYPES[0]:
        notes.append(f"The file holds no measured markers; positions of the type {kind!r} are taken.")
    return [name for name, _ in named], [column for _, column in named], tuple(notes)


def _triples(axes: list[str]) -> Iterator[tuple[int, str]]:
    """Every column with the axes that it and its two neighbours hold."""
    return ((i, "".join(axes[i : i + 3])) for i in range(len(axes) - 2))


def _is_position(header: _Header, column: int) -> bool:
    kinds = header.rows[-1]
    return column < len(kinds) and kinds[column].strip() == "Position"


def _thrice(cells: Iterator[str]) -> Iterator[str]:
    return (cell for one in cells for cell in (one,) * 3)
