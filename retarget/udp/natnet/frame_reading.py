"""FRAMEOFDATA from bytes: bitstream 2.5 to 4.3.

From 4.1 every section says how many bytes it has, and a frame whose sections do not add up is refused. A frame ends
with four zero bytes and nothing behind them, in all versions.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from retarget.errors import ProtocolError
from retarget.udp.natnet.framedata import (
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
from retarget.udp.natnet.records import BODY, MARKER, body_record, marker_record
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
_TAIL_OCTETS = 6
_NAME_OCTETS = 1
_COUNT_OCTETS = 4
_BODY_HEAD_OCTETS = 32
_BODY_MARKER_OCTETS = 20

_SIZED = struct.Struct("<ii")
_TIMECODE = struct.Struct("<II")
_FLOAT32 = struct.Struct("<f")
_FLOAT64 = struct.Struct("<d")
_TICKS = struct.Struct("<QQQ")
_PRECISION = struct.Struct("<II")
_PARAMS = struct.Struct("<H")


def read_frame(cursor: Cursor, layout: BitstreamLayout) -> FrameOfData:
    """Read the payload of a FRAMEOFDATA to its end; raise `ProtocolError` where it does not follow `layout`."""
    number = cursor.int32()
    marker_sets = _section(cursor, layout, _marker_sets)
    other_markers = _section(cursor, layout, _positions)
    bodies = _section(cursor, layout, _bodies)
    skeletons = _section(cursor, layout, _skeletons)
    assets = _section(cursor, layout, _assets) if layout.assets else ()
    labelled = _section(cursor, layout, _labelled)
    force_plates = _section(cursor, layout, _analog) if layout.force_plates else ()
    devices = _section(cursor, layout, _analog) if layout.devices else ()
    latency = cursor.unpack(_FLOAT32)[0] if layout.software_latency else None
    timecode, subframe = cursor.unpack(_TIMECODE)
    timestamp_s = _timestamp(cursor, layout)
    ticks = Ticks(*cursor.unpack(_TICKS)) if layout.ticks else None
    precision = _precision(cursor, layout)
    params = cursor.unpack(_PARAMS)[0] if layout.params else 0
    _end_of_data(cursor)
    return FrameOfData(
        number,
        marker_sets,
        other_markers,
        bodies,
        skeletons,
        assets,
        labelled,
        force_plates,
        devices,
        latency,
        timecode,
        subframe,
        timestamp_s,
        ticks,
        precision,
        params,
    )


def _section(cursor: Cursor, layout: BitstreamLayout, entries: Callable[[Cursor, BitstreamLayout, int], T]) -> T:
    """Read the count of a section, its entries, and hold them against its size where the bitstream tells it."""
    if not layout.section_sizes:
        return entries(cursor, layout, cursor.int32())
    count, octets = cursor.unpack(_SIZED)
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


def _timestamp(cursor: Cursor, layout: BitstreamLayout) -> float | None:
    if layout.timestamp is TimestampForm.ABSENT:
        return None
    form = _FLOAT64 if layout.timestamp is TimestampForm.FLOAT64 else _FLOAT32
    seconds: float = cursor.unpack(form)[0]
    return seconds


def _precision(cursor: Cursor, layout: BitstreamLayout) -> PrecisionTime | None:
    """Read the precision time stamp; where sources disagree on it, the frame's fixed tail tells whether it is there."""
    if layout.precision is PrecisionForm.ABSENT:
        return None
    if layout.precision is PrecisionForm.EITHER and cursor.left == _TAIL_OCTETS:
        return None
    return PrecisionTime(*cursor.unpack(_PRECISION))


def _end_of_data(cursor: Cursor) -> None:
    tag = cursor.int32()
    if tag != _END:
        raise ProtocolError(f"The frame ends with {tag} in place of 0.")
    cursor.finish()
