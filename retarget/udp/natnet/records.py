"""Records of fixed size on the wire, as numpy types: little-endian, packed.

A block of markers or rigid bodies is read and written as one array of records, never record by record.
Positions [m], quaternions xyzw, marker sizes [m], residuals [m/ray], mean errors [m].
"""

from __future__ import annotations

from enum import IntFlag
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.udp.natnet.version import BitstreamLayout

FLOAT: np.dtype[np.float32] = np.dtype("<f4")
INT: np.dtype[np.int32] = np.dtype("<i4")

NO_POSITIONS: NDArray[np.float32] = np.empty((0, 3), FLOAT)
NO_FLOATS: NDArray[np.float32] = np.empty(0, FLOAT)
"""What empty blocks are, without an array each."""

_MARKER: list[tuple[str, str] | tuple[str, str, tuple[int, ...]]] = [
    ("id", "<i4"),
    ("position", "<f4", (3,)),
    ("size", "<f4"),
]
MARKER_PLAIN = np.dtype(_MARKER)
"""Labelled marker of 2.5, 20 bytes."""
MARKER_PARAMS = np.dtype([*_MARKER, ("params", "<u2")])
"""Labelled marker of 2.6 to 2.11, 22 bytes."""
MARKER = np.dtype([*_MARKER, ("params", "<u2"), ("residual", "<f4")])
"""Labelled marker from 3.0, and marker of an asset: 26 bytes."""

_BODY: list[tuple[str, str] | tuple[str, str, tuple[int, ...]]] = [
    ("id", "<i4"),
    ("position", "<f4", (3,)),
    ("quat_xyzw", "<f4", (4,)),
    ("error", "<f4"),
]
BODY_PLAIN = np.dtype(_BODY)
"""Rigid body of 2.5 without its markers, 36 bytes."""
BODY = np.dtype([*_BODY, ("params", "<u2")])
"""Rigid body from 2.6, 38 bytes; before 3.0 its markers stand between quaternion and error."""


class MarkerFlag(IntFlag):
    """Bits of a labelled marker's `params`; the last five since 3.0."""

    OCCLUDED = 1
    """Not seen: the position is filled in or stale, never a measurement."""
    POINT_CLOUD_SOLVED = 2
    MODEL_FILLED = 4
    HAS_MODEL = 8
    UNLABELLED = 16
    ACTIVE = 32
    ESTABLISHED = 64
    MEASUREMENT = 128


class BodyFlag(IntFlag):
    """Bits of a rigid body's `params`."""

    TRACKED = 1


class FrameFlag(IntFlag):
    """Bits of a frame's `params`."""

    RECORDING = 1
    MODELS_CHANGED = 2
    """The list of models changed: ask for the definitions again."""
    EDIT_MODE = 4
    """Played back from a file, not live."""
    BITSTREAM_CHANGED = 8
    """The sender changed its bitstream version: connect again."""


def marker_record(layout: BitstreamLayout) -> np.dtype[np.void]:
    """Record of a labelled marker in this bitstream."""
    if layout.residual:
        return MARKER
    return MARKER_PARAMS if layout.params else MARKER_PLAIN


def body_record(layout: BitstreamLayout) -> np.dtype[np.void]:
    """Record of a rigid body in this bitstream, its markers left out."""
    return BODY if layout.params else BODY_PLAIN


def as_record(table: NDArray[np.void], record: np.dtype[np.void]) -> NDArray[np.void]:
    """The same table in another bitstream's record: fields that only one of them has are zero or left out."""
    if table.dtype == record:
        return table
    converted = np.zeros(table.shape, record)
    for name in _names(record):
        if name in _names(table.dtype):
            converted[name] = table[name]
    return converted


def column(table: NDArray[np.void], name: str, default: float) -> NDArray[Any]:
    """One field of all records, or `default` everywhere when the bitstream has no such field."""
    if name in _names(table.dtype):
        return table[name]
    return np.full(table.shape, default, MARKER[name])


def _names(record: np.dtype[np.void]) -> tuple[str, ...]:
    return record.names or ()
