"""The header of a C3D file: is it one, and are all its data there?

Asked before the file is parsed, because it gives the clearer sentence. Source: The C3D File Format User Guide
(c3d.org), header section; words are two bytes, blocks 512.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

from retarget.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

BLOCK = 512
MAGIC = 0x50
INTEL, DEC, MIPS = 84, 85, 86
AGAIN = "Export it again from the program that made it."


@dataclass(frozen=True, slots=True)
class Header:
    """The fields that say where the data are."""

    points: int
    analog_values: int
    """Per frame of points."""
    first_frame: int
    last_frame: int
    scale: float
    """Negative where the data are floating point numbers."""
    data_block: int
    """Counted from 1."""

    @property
    def frame_bytes(self) -> int:
        """Length of one frame of the data section."""
        return (4 * self.points + self.analog_values) * (4 if self.scale < 0 else 2)

    @property
    def frames(self) -> int:
        """How many frames the header promises; it cannot count beyond 65,535."""
        return self.last_frame - self.first_frame + 1


def read_header(path: Path, data: bytes) -> Header:
    """The header of `data`; InputError, naming `path`, where it is none, or the file is damaged or cut short."""
    if not data:
        raise InputError(f"{path} is empty; expected a C3D file.")
    if len(data) < 2 * BLOCK or data[1] != MAGIC or data[0] < 2:
        raise InputError(f"{path} is not a C3D file: it does not begin with the header of one.")
    processor = _processor(data)
    if processor == MIPS:
        raise InputError(f"{path} is a C3D file in SGI/MIPS byte order, which is not read; save it in Intel order.")
    if processor not in (INTEL, DEC):
        raise InputError(f"{path} is damaged: its parameters are not where its header says. {AGAIN}")
    points, analog, first, last = struct.unpack_from("<4H", data, 2)
    header = Header(points, analog, first, last, _scale(data, processor), struct.unpack_from("<H", data, 16)[0])
    _check(path, header, len(data))
    return header


def _processor(data: bytes) -> int:
    """The byte order in which the file was written, -1 where the file ends before it tells."""
    at = (data[0] - 1) * BLOCK + 3
    return data[at] if at < len(data) else -1


def _scale(data: bytes, processor: int) -> float:
    if processor == INTEL:
        return float(struct.unpack_from("<f", data, 12)[0])
    # A VAX number: the half with the exponent comes first, and the exponent is larger by two.
    high, low = struct.unpack_from("<2H", data, 12)
    return float(struct.unpack("<f", struct.pack("<2H", low, high))[0]) / 4


def _check(path: Path, header: Header, length: int) -> None:
    if header.points == 0:
        raise InputError(f"{path} holds no points; expected a C3D file with markers.")
    if header.frames < 1 or header.data_block < 3 or not math.isfinite(header.scale):
        raise InputError(f"{path} is damaged: its header makes no sense. {AGAIN}")
    there = max(0, length - (header.data_block - 1) * BLOCK) // header.frame_bytes
    if there < header.frames:
        raise InputError(
            f"{path} is cut short: it should hold {header.frames} frames, but ends after {there}. Copy it again."
        )
