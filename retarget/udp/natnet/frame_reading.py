"""FRAMEOFDATA from bytes: bitstream 2.5 to 4.3.

From 4.1 every section says how many bytes it has, and a frame whose sections do not add up is refused. A frame ends
with four zero bytes and nothing behind them, in all versions.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, TypeAlias, TypeVar

import numpy as np

from retarget.errors import ProtocolError
from retarget.udp.natnet.framedata import (
    NO_BODIES,
    NO_MARKERS,
    AnalogSamples,
    Asset,
    BodyMarkers,
    FrameOfData,
    LabelledMarkers,
    MarkerSet,
    PrecisionTime,
    RigidBodies,
    Skeleton,
    Ticks,
)
from retarget.udp.natnet.records import BODY, MARKER, NO_POSITIONS, body_record, marker_record
from retarget.udp.natnet.version import PrecisionForm, TimestampForm

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from retarget.udp.natnet.reader import Cursor
    from retarget.udp.natnet.version import BitstreamLayout

T = TypeVar("T")

MAX_MARKER_SETS = 1000
MAX_BODIES_WITH_MARKERS = 1000
MAX_SKELETONS = 100
MAX_ASSETS = 1000
MAX_ANALOG = 100
MAX_CHANNELS = 1000
"""Limits of what costs an object each; blocks of markers are bounded by the bytes alone."""

_END = 0
_NAME_OCTETS = 1
_COUNT_OCTETS = 4
_BODY_HEAD_OCTETS = 32
_BODY_MARKER_OCTETS = 20

_SUFFIX = struct.Struct("<IIdQQQHi")
_SUFFIX_PRECISE = struct.Struct("<IIdQQQIIHi")
_EARLY_SUFFIXES = {
    TimestampForm.ABSENT: struct.Struct("<fIIi"),
    TimestampForm.FLOAT32: struct.Struct("<fIIfHi"),
    TimestampForm.FLOAT64: struct.Struct("<fIIdHi"),
}
Suffix: TypeAlias = tuple[float | None, int, int, float | None, Ticks | None, PrecisionTime | None, int]
"""The last seven fields of a `FrameOfData`."""


def read_frame(cursor: Cursor, layout: BitstreamLayout) -> FrameOfData:
    """Read the payload of a FRAMEOFDATA to its end; raise `ProtocolError` where it does not follow `layout`."""
    return FrameOfData(
        cursor.int32(),
        _section(cursor, layout, _marker_sets, ()),
        _section(cursor, layout, _positions, NO_POSITIONS),
        _section(cursor, layout, _bodies, NO_BODIES),
        _section(cursor, layout, _skeletons, ()),
        _section(cursor, layout, _assets, ()) if layout.assets else (),
        _section(cursor, layout, _labelled, NO_MARKERS),
        _section(cursor, layout, _analog, ()) if layout.force_plates else (),
        _section(cursor, layout, _analog, ()) if layout.devices else (),
        *(_suffix(cursor, layout) if layout.ticks else _early_suffix(cursor, layout)),
    )


def _section(
    cursor: Cursor, layout: BitstreamLayout, entries: Callable[[Cursor, BitstreamLayout, int], T], nothing: T
) -> T:
    """Read the count of a section, its entries, and hold them against its size where the bitstream tells it."""
    if not layout.section_sizes:
        return entries(cursor, layout, cursor.int32())
    count, octets = cursor.int32_pair()
    if count == octets == 0:
        return nothing
    start = cursor.at
    value = entries(cursor, layout, count)
    if cursor.at - start != octets:
        raise ProtocolError(f"The section at byte {start} has {cursor.at - start} bytes and announces {octets}.")
    return value


def _marker_sets(cursor: Cursor, _: BitstreamLayout, count: int) -> tuple[MarkerSet, ...]:
    cursor.bounded(count, _NAME_OCTETS + _COUNT_OCTETS, MAX_MARKER_SETS)
    return tuple([MarkerSet(cursor.text(), cursor.positions(cursor.int32())) for _ in range(count)])


def _positions(cursor: Cursor, _: BitstreamLayout, count: int) -> NDArray[np.float32]:
    return cursor.positions(count)


def _labelled(cursor: Cursor, layout: BitstreamLayout, count: int) -> LabelledMarkers:
    return LabelledMarkers(cursor.table(marker_record(layout), count))


def _bodies(cursor: Cursor, layout: BitstreamLayout, count: int) -> RigidBodies:
    if layout.rigid_body_markers:
        return _bodies_with_markers(cursor, layout, count)
    return RigidBodies(cursor.table(BODY, count))


def _bodies_with_markers(cursor: Cursor, layout: BitstreamLayout, count: int) -> RigidBodies:
    """Before 3.0 each body's markers stand in the middle of its record, which is put together around them."""
    record = body_record(layout)
    cursor.bounded(count, record.itemsize + _COUNT_OCTETS, MAX_BODIES_WITH_MARKERS)
    pieces: list[bytes] = []
    markers: list[BodyMarkers] = []
    for _ in range(count):
        pieces.append(cursor.octets(_BODY_HEAD_OCTETS))
        markers.append(_body_markers(cursor))
        pieces.append(cursor.octets(record.itemsize - _BODY_HEAD_OCTETS))
    return RigidBodies(np.frombuffer(b"".join(pieces), record), tuple(markers))


def _body_markers(cursor: Cursor) -> BodyMarkers:
    count = cursor.count(_BODY_MARKER_OCTETS)
    return BodyMarkers(cursor.positions(count), cursor.ints(count), cursor.floats(count))


def _skeletons(cursor: Cursor, layout: BitstreamLayout, count: int) -> tuple[Skeleton, ...]:
    cursor.bounded(count, 2 * _COUNT_OCTETS, MAX_SKELETONS)
    return tuple([Skeleton(cursor.int32(), _bodies(cursor, layout, cursor.int32())) for _ in range(count)])


def _assets(cursor: Cursor, layout: BitstreamLayout, count: int) -> tuple[Asset, ...]:
    cursor.bounded(count, 3 * _COUNT_OCTETS, MAX_ASSETS)
    return tuple([_asset(cursor, layout) for _ in range(count)])


def _asset(cursor: Cursor, layout: BitstreamLayout) -> Asset:
    number = cursor.int32()
    bodies = _bodies(cursor, layout, cursor.int32())
    return Asset(number, bodies, LabelledMarkers(cursor.table(MARKER, cursor.int32())))


def _analog(cursor: Cursor, _: BitstreamLayout, count: int) -> tuple[AnalogSamples, ...]:
    cursor.bounded(count, 2 * _COUNT_OCTETS, MAX_ANALOG)
    return tuple([AnalogSamples(cursor.int32(), _channels(cursor)) for _ in range(count)])


def _channels(cursor: Cursor) -> tuple[NDArray[np.float32], ...]:
    count = cursor.count(_COUNT_OCTETS, MAX_CHANNELS)
    return tuple([cursor.floats(cursor.int32()) for _ in range(count)])


def _suffix(cursor: Cursor, layout: BitstreamLayout) -> Suffix:
    """Read all behind the last section, from 3.0; where sources disagree (4.0) the bytes left tell which form it is."""
    with_precision = layout.precision is PrecisionForm.PRESENT or (
        layout.precision is PrecisionForm.EITHER and cursor.left != _SUFFIX.size
    )
    values = cursor.last(_SUFFIX_PRECISE if with_precision else _SUFFIX)
    timecode, subframe, timestamp_s, exposed, received, sent, *precision, params, end = values
    _require_end(end)
    precise = PrecisionTime(*precision) if with_precision else None
    return None, timecode, subframe, timestamp_s, Ticks(exposed, received, sent), precise, params


def _early_suffix(cursor: Cursor, layout: BitstreamLayout) -> Suffix:
    """Read all behind the last section, before 3.0."""
    latency, timecode, subframe, *stamped, end = cursor.last(_EARLY_SUFFIXES[layout.timestamp])
    _require_end(end)
    timestamp_s, params = stamped or (None, 0)
    return latency, timecode, subframe, timestamp_s, None, None, params


def _require_end(tag: int) -> None:
    if tag != _END:
        raise ProtocolError(f"The frame ends with {tag} in place of {_END}.")
