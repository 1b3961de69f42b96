"""What text files of markers have in common: lines, numbers, units and rows by frame number."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from retarget.errors import InputError
from retarget.markers.c3d import METRES

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MAX_FILE_BYTES: Final = 2_000_000_000
_MOST_TIMES_LONGER: Final = 20
"""A gap in the frame numbers is filled with unseen markers unless that makes the take so many times longer."""
_MORE_UNITS: Final = {"centimeter": 1e-2, "centimeters": 1e-2, "centimetre": 1e-2, "centimetres": 1e-2}


def read_text(path: Path) -> str:
    """The file with line feeds at the ends of lines; bytes that are no UTF-8 become replacement characters.

    Raises InputError where it cannot be read.
    """
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise InputError(f"{path} is larger than the {MAX_FILE_BYTES} bytes that can be read")
        text = path.read_bytes().decode("utf-8-sig", "replace")
        return text.replace("\r\n", "\n").replace("\r", "\n")
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from error


def number(text: str) -> float:
    """A number, NaN for an empty cell or anything else."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def metres_per_unit(path: Path, unit: str) -> float:
    """Length of a named unit [m]. Raises InputError for one that is not known."""
    known = METRES | _MORE_UNITS
    if unit.strip().casefold() not in known:
        raise InputError(f"{path} gives its positions in the unit {unit.strip()!r}; expected one of {', '.join(known)}")
    return known[unit.strip().casefold()]


def rate_from(path: Path, told: Sequence[float], times_s: Array) -> float:
    """The first of the rates told that makes sense, else that of the times [Hz]. Raises InputError without either."""
    for rate in told:
        if math.isfinite(rate) and rate > 0:
            return rate
    steps = np.diff(times_s)
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else math.nan
    if not math.isfinite(step):
        raise InputError(f"{path} does not say how many frames a second it has")
    return 1 / step


def positions_from(rows: Sequence[Sequence[str]], columns: Sequence[int]) -> Array:
    """(N, M, 3) from the cells of each row: X, Y and Z from each of `columns` on; NaN where one of the three lacks."""
    wanted = [column + axis for column in columns for axis in range(3)]
    end = max(wanted, default=0) + 1
    values = np.empty((len(rows), len(wanted)))
    for i, cells in enumerate(rows):
        padded = [*cells, *[""] * (end - len(cells))]
        values[i] = [number(padded[column]) for column in wanted]
    positions = values.reshape(len(rows), len(columns), 3)
    positions[~np.isfinite(positions).all(axis=2)] = np.nan
    return positions


def by_number(numbers: Sequence[float], positions: Array) -> tuple[int, Array, tuple[str, ...]]:
    """(first number, positions with a row for each number from the first to the last, what had to be decided)."""
    first = int(numbers[0]) if math.isfinite(numbers[0]) else 1
    steps = np.diff(np.asarray(numbers, float))
    if (steps == 1).all():
        return first, positions, ()
    if not (steps >= 1).all() or (steps % 1).any() or numbers[-1] - numbers[0] > _MOST_TIMES_LONGER * len(numbers):
        return first, positions, ("Its frame numbers do not go up one by one; rows are taken in their order.",)
    index = (np.asarray(numbers) - first).astype(int)
    filled = np.full((index[-1] + 1, *positions.shape[1:]), np.nan)
    filled[index] = positions
    return first, filled, (f"{len(filled) - len(index)} frame numbers are left out; nothing was seen there.",)


def shortness(rows: int, told: float) -> tuple[str, ...]:
    """A sentence where the header tells more frames than there are."""
    if rows < told:
        return (f"The file is cut: it holds {rows} whole frames where its header says {told:.0f}.",)
    return ()
