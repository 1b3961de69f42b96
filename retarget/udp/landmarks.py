"""Our own datagrams for a stream of named points: landmarks of a camera, or markers of any other source.

Two kinds, little-endian, each in one datagram. Both begin with 16 bytes: ``RTLM``, version (u8, 1), kind (u8), number
of points (u16), layout (u64: the first 8 bytes, read little-endian, of the SHA-256 of the layout's name and the points'
names, UTF-8, each closed by a NUL).

======  ========================================================================================================
kind 1  the layout, sent first and once a second: its name, then the points' names, each a u8 length and UTF-8
kind 2  the points: session (u32, drawn by chance when the sender starts), sequence (u64, counts from 0), time
        (f64, seconds of the sender's clock), confidence (f32, 0 to 1), then x, y, z (f32, metres) for each point,
        NaN for one that is not seen
======  ========================================================================================================

478 points make 5,776 bytes. Input is hostile: whatever is not exactly this ends in ProtocolError.
"""

from __future__ import annotations

import hashlib
import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from retarget.errors import InputError, ProtocolError
from retarget.frames import MarkerLayout

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

MAGIC = b"RTLM"
VERSION = 1
MAX_POINTS = 4096
MAX_NAME_BYTES = 255
MAX_DATAGRAM_BYTES = 65_507
"""Payload of the largest UDP datagram over IPv4."""
LARGEST_TIME_S = 1e12

_HEAD = struct.Struct("<4sBBHQ")
_POINTS = struct.Struct("<IQdf")
_LAYOUT_KIND, _POINTS_KIND = 1, 2


@dataclass(frozen=True, slots=True, eq=False)
class LayoutMessage:
    """Which points there are."""

    layout_id: int
    layout: MarkerLayout


@dataclass(frozen=True, slots=True, eq=False)
class PointsMessage:
    """Where the points are."""

    layout_id: int
    session: int
    sequence: int
    time_s: float
    """The sender's clock [s]."""
    confidence: float
    positions: NDArray[np.float64]
    """(M, 3) [m]; a point that is not seen is a NaN row."""


Message: TypeAlias = LayoutMessage | PointsMessage


def layout_id(name: str, names: Sequence[str]) -> int:
    """The number by which points refer to their names."""
    text = "".join(f"{part}\0" for part in (name, *names))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")


def is_points(payload: bytes) -> bool:
    """Whether it looks like a datagram of points, by its first bytes alone."""
    return len(payload) >= _HEAD.size and payload[:4] == MAGIC and payload[5] == _POINTS_KIND


def encode_layout(layout: MarkerLayout) -> bytes:
    """The datagram that names the points; InputError where the names are too many or too long for one."""
    names = [name.encode() for name in (layout.name, *layout.names)]
    body = b"".join(bytes([len(name)]) + name for name in names if len(name) <= MAX_NAME_BYTES)
    if not 0 < len(layout.names) <= MAX_POINTS or max(map(len, names)) > MAX_NAME_BYTES:
        raise InputError(
            f"The layout {layout.name} cannot be sent: it may have 1 to {MAX_POINTS} points, with names of at most "
            f"{MAX_NAME_BYTES} bytes."
        )
    if _HEAD.size + len(body) > MAX_DATAGRAM_BYTES:
        raise InputError(f"The names of the layout {layout.name} do not fit into one datagram; shorten them.")
    return _head(_LAYOUT_KIND, len(layout.names), layout_id(layout.name, layout.names)) + body


def encode_points(message: PointsMessage) -> bytes:
    """The datagram of one frame."""
    head = _head(_POINTS_KIND, len(message.positions), message.layout_id)
    fixed = _POINTS.pack(message.session, message.sequence, message.time_s, message.confidence)
    return head + fixed + message.positions.astype("<f4").tobytes()


def decode(payload: bytes) -> Message:
    """What a datagram says; ProtocolError where it is not one of these."""
    if len(payload) < _HEAD.size:
        raise ProtocolError(f"A datagram of points has at least {_HEAD.size} bytes, not {len(payload)}.")
    magic, version, kind, count, layout = _HEAD.unpack_from(payload)
    if magic != MAGIC or version != VERSION:
        raise ProtocolError(f"A datagram of points begins with {MAGIC.decode()} and version {VERSION}.")
    if not 0 < count <= MAX_POINTS:
        raise ProtocolError(f"A datagram of points has 1 to {MAX_POINTS} points, not {count}.")
    if kind == _LAYOUT_KIND:
        return _decode_layout(payload, count, layout)
    if kind == _POINTS_KIND:
        return _decode_points(payload, count, layout)
    raise ProtocolError(f"A datagram of points is of kind {_LAYOUT_KIND} or {_POINTS_KIND}, not {kind}.")


def _head(kind: int, count: int, layout: int) -> bytes:
    return _HEAD.pack(MAGIC, VERSION, kind, count, layout)


def _decode_layout(payload: bytes, count: int, layout: int) -> LayoutMessage:
    texts, at = [], _HEAD.size
    for _ in range(count + 1):
        end = at + 1 + payload[at] if at < len(payload) else at + 1
        if end > len(payload):
            raise ProtocolError("A layout is cut short.")
        texts.append(payload[at + 1 : end])
        at = end
    if at != len(payload):
        raise ProtocolError("A layout is longer than its names.")
    try:
        name, *names = (text.decode() for text in texts)
    except UnicodeDecodeError as error:
        raise ProtocolError("A name in a layout is not UTF-8.") from error
    if len(set(names)) < count or not all(names) or any("\0" in text for text in (name, *names)):
        raise ProtocolError("The names in a layout must be unique, and none may be empty or hold a NUL.")
    if layout_id(name, names) != layout:
        raise ProtocolError("A layout does not have the number that its names give.")
    return LayoutMessage(layout, MarkerLayout(name, tuple(names)))


def _decode_points(payload: bytes, count: int, layout: int) -> PointsMessage:
    start = _HEAD.size + _POINTS.size
    if len(payload) != start + 12 * count:
        raise ProtocolError(f"{count} points make a datagram of {start + 12 * count} bytes, not {len(payload)}.")
    session, sequence, time_s, confidence = _POINTS.unpack_from(payload, _HEAD.size)
    if not math.isfinite(time_s) or abs(time_s) > LARGEST_TIME_S or not 0.0 <= confidence <= 1.0:
        raise ProtocolError("A datagram of points has an impossible time or confidence.")
    positions = np.frombuffer(payload, "<f4", offset=start).reshape(count, 3).astype(float)
    if np.isinf(positions).any():
        raise ProtocolError("A datagram of points has a point at infinity.")
    positions[np.isnan(positions).any(axis=1)] = np.nan
    return PointsMessage(layout, session, sequence, time_s, confidence, positions)
