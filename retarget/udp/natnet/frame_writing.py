"""FRAMEOFDATA to bytes: bitstream 2.5 to 4.3.

A frame read from one version can be written in another: what the other does not carry is left out, what it adds is
zero.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, TypeVar

from retarget.errors import InputError
from retarget.udp.natnet.records import BODY, MARKER, as_record, body_record, marker_record
from retarget.udp.natnet.version import PrecisionForm, TimestampForm
from retarget.udp.natnet.writer import Writer

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from retarget.udp.natnet.framedata import (
        AnalogSamples,
        Asset,
        BodyMarkers,
        FrameOfData,
        LabelledMarkers,
        MarkerSet,
        RigidBodies,
        Skeleton,
    )
    from retarget.udp.natnet.version import BitstreamLayout

T = TypeVar("T")

_BODY_HEAD_OCTETS = 32
_FLOAT32 = struct.Struct("<f")
_FLOAT64 = struct.Struct("<d")
_TIMECODE = struct.Struct("<II")
_TICKS = struct.Struct("<QQQ")
_PRECISION = struct.Struct("<II")
_PARAMS = struct.Struct("<H")
_END = 0


def write_frame(out: Writer, frame: FrameOfData, layout: BitstreamLayout) -> None:
    """Write the payload of a FRAMEOFDATA; raise `InputError` for a value that does not fit."""
    out.int32(frame.number)
    _section(out, layout, len(frame.marker_sets), _marker_sets, frame.marker_sets)
    _section(out, layout, len(frame.other_markers), _positions, frame.other_markers)
    _section(out, layout, len(frame.bodies), _bodies, frame.bodies)
    _section(out, layout, len(frame.skeletons), _skeletons, frame.skeletons)
    if layout.assets:
        _section(out, layout, len(frame.assets), _assets, frame.assets)
    _section(out, layout, len(frame.labelled), _labelled, frame.labelled)
    if layout.force_plates:
        _section(out, layout, len(frame.force_plates), _analog, frame.force_plates)
    if layout.devices:
        _section(out, layout, len(frame.devices), _analog, frame.devices)
    _write_suffix(out, frame, layout)


def _section(
    out: Writer, layout: BitstreamLayout, count: int, write: Callable[[Writer, T, BitstreamLayout], None], entries: T
) -> None:
    if not layout.section_sizes:
        out.int32(count)
        write(out, entries, layout)
        return
    body = Writer()
    write(body, entries, layout)
    out.sized(count, body)


def _write_suffix(out: Writer, frame: FrameOfData, layout: BitstreamLayout) -> None:
    if layout.software_latency:
        out.pack(_FLOAT32, _or_zero(frame.software_latency))
    out.pack(_TIMECODE, frame.timecode, frame.timecode_subframe)
    if layout.timestamp is not TimestampForm.ABSENT:
        out.pack(_FLOAT64 if layout.timestamp is TimestampForm.FLOAT64 else _FLOAT32, _or_zero(frame.timestamp_s))
    if layout.ticks:
        ticks = frame.ticks
        out.pack(_TICKS, *((ticks.mid_exposure, ticks.received, ticks.transmit) if ticks else (0, 0, 0)))
    _write_precision(out, frame, layout)
    if layout.params:
        out.pack(_PARAMS, frame.params)
    out.int32(_END)


def _or_zero(value: float | None) -> float:
    return 0.0 if value is None else value


def _write_precision(out: Writer, frame: FrameOfData, layout: BitstreamLayout) -> None:
    precision = frame.precision
    if layout.precision is PrecisionForm.PRESENT or (
        layout.precision is PrecisionForm.EITHER and precision is not None
    ):
        out.pack(_PRECISION, *((precision.seconds, precision.fraction) if precision else (0, 0)))


def _marker_sets(out: Writer, sets: tuple[MarkerSet, ...], layout: BitstreamLayout) -> None:
    for markers in sets:
        out.text(markers.name)
        out.int32(len(markers.positions))
        _positions(out, markers.positions, layout)


def _positions(out: Writer, positions: NDArray[np.float32], _: BitstreamLayout) -> None:
    out.floats(positions, -1, 3)


def _labelled(out: Writer, markers: LabelledMarkers, layout: BitstreamLayout) -> None:
    out.table(as_record(markers.table, marker_record(layout)))


def _bodies(out: Writer, bodies: RigidBodies, layout: BitstreamLayout) -> None:
    table = as_record(bodies.table, body_record(layout))
    if layout.rigid_body_markers:
        _bodies_with_markers(out, table, bodies.markers or (None,) * len(table))
    else:
        out.table(table)


def _bodies_with_markers(out: Writer, table: NDArray[np.void], markers: tuple[BodyMarkers | None, ...]) -> None:
    """Before 3.0 each body's markers stand in the middle of its record."""
    if len(markers) != len(table):
        raise InputError(
            f"{len(table)} rigid bodies have markers for {len(markers)}; give each its own, or none at all."
        )
    for row, of_body in zip(table, markers, strict=True):
        octets = row.tobytes()
        out.octets(octets[:_BODY_HEAD_OCTETS])
        _body_markers(out, of_body)
        out.octets(octets[_BODY_HEAD_OCTETS:])


def _body_markers(out: Writer, markers: BodyMarkers | None) -> None:
    if markers is None:
        out.int32(0)
        return
    count = len(markers.positions)
    out.int32(count)
    out.floats(markers.positions, count, 3)
    out.ints(markers.ids, count)
    out.floats(markers.sizes, count)


def _skeletons(out: Writer, skeletons: tuple[Skeleton, ...], layout: BitstreamLayout) -> None:
    for skeleton in skeletons:
        out.int32(skeleton.id)
        out.int32(len(skeleton.bones))
        _bodies(out, skeleton.bones, layout)


def _assets(out: Writer, assets: tuple[Asset, ...], _: BitstreamLayout) -> None:
    for asset in assets:
        out.int32(asset.id)
        out.int32(len(asset.bodies))
        out.table(as_record(asset.bodies.table, BODY))
        out.int32(len(asset.markers))
        out.table(as_record(asset.markers.table, MARKER))


def _analog(out: Writer, boxes: tuple[AnalogSamples, ...], _: BitstreamLayout) -> None:
    for box in boxes:
        out.int32(box.id)
        out.int32(len(box.channels))
        for samples in box.channels:
            out.int32(len(samples))
            out.floats(samples, -1)
