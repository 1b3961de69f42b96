"""MODELDEF from bytes: bitstream 2.5 to 4.3.

From 4.1 each description tells its size, so that one of an unknown type, or one whose body does not follow its type, is
kept unread and the others still count: names should not be lost over a camera. Before 4.1 an unknown type hides all
that follows.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from retarget.errors import ProtocolError
from retarget.udp.natnet.models import (
    AssetDescription,
    AssetMarkerDescription,
    CameraDescription,
    DescribedMarkers,
    DeviceDescription,
    ForcePlateDescription,
    MarkerSetDescription,
    ModelDef,
    OpaqueDescription,
    RigidBodyDescription,
    SkeletonDescription,
    UnreadDescriptions,
)
from retarget.udp.natnet.reader import Cursor

if TYPE_CHECKING:
    from collections.abc import Callable

    from retarget.udp.natnet.models import Description
    from retarget.udp.natnet.version import BitstreamLayout

MAX_DESCRIPTIONS = 2000

_NAME_OCTETS = 1
_TYPE_OCTETS = 4
_BODY_OCTETS = 21
_ASSET_MARKER_OCTETS = 23
_DESCRIBED_MARKER_OCTETS = 16
_PARAMS = struct.Struct("<H")


def read_model_def(cursor: Cursor, layout: BitstreamLayout) -> ModelDef:
    """Read the payload of a MODELDEF to its end; raise `ProtocolError` where it does not follow `layout`."""
    count = cursor.count(_TYPE_OCTETS, MAX_DESCRIPTIONS)
    descriptions: list[Description] = []
    for index in range(count):
        start = cursor.at
        kind = cursor.int32()
        read = _reader_of(kind, layout)
        if layout.section_sizes:
            descriptions.append(_sized_description(cursor, layout, kind))
        elif read is not None:
            descriptions.append(read(cursor, layout))
        else:
            cursor.at = start
            return ModelDef(tuple(descriptions), UnreadDescriptions(count - index, cursor.rest()))
    cursor.finish()
    return ModelDef(tuple(descriptions))


def _reader_of(kind: int, layout: BitstreamLayout) -> Callable[[Cursor, BitstreamLayout], Description] | None:
    return _ASSET_READERS.get(kind) if layout.assets else _READERS.get(kind)


def _sized_description(cursor: Cursor, layout: BitstreamLayout, kind: int) -> Description:
    body = cursor.octets(cursor.int32())
    read = _reader_of(kind, layout)
    if read is None:
        return OpaqueDescription(kind, body)
    inner = Cursor(body)
    try:
        description = read(inner, layout)
        inner.finish()
    except ProtocolError:
        return OpaqueDescription(kind, body)
    return description


def _marker_set(cursor: Cursor, _: BitstreamLayout) -> MarkerSetDescription:
    return MarkerSetDescription(cursor.text(), _texts(cursor))


def _rigid_body(cursor: Cursor, layout: BitstreamLayout) -> RigidBodyDescription:
    return RigidBodyDescription(
        name=cursor.text(),
        id=cursor.int32(),
        parent_id=cursor.int32(),
        offset=cursor.floats(3),
        rotation_xyzw=cursor.floats(4) if layout.described_rotation else None,
        markers=_described_markers(cursor, layout) if layout.described_markers else None,
    )


def _described_markers(cursor: Cursor, layout: BitstreamLayout) -> DescribedMarkers:
    count = cursor.count(_DESCRIBED_MARKER_OCTETS)
    return DescribedMarkers(
        positions=cursor.positions(count),
        active_labels=cursor.ints(count),
        names=cursor.texts(count) if layout.described_marker_names else (),
    )


def _skeleton(cursor: Cursor, layout: BitstreamLayout) -> SkeletonDescription:
    return SkeletonDescription(cursor.text(), cursor.int32(), _rigid_bodies(cursor, layout))


def _rigid_bodies(cursor: Cursor, layout: BitstreamLayout) -> tuple[RigidBodyDescription, ...]:
    count = cursor.count(_BODY_OCTETS)
    return tuple([_rigid_body(cursor, layout) for _ in range(count)])


def _force_plate(cursor: Cursor, _: BitstreamLayout) -> ForcePlateDescription:
    return ForcePlateDescription(
        id=cursor.int32(),
        serial=cursor.text(),
        size=cursor.floats(2),
        origin=cursor.floats(3),
        calibration=cursor.floats(144).reshape(12, 12),
        corners=cursor.positions(4),
        plate_type=cursor.int32(),
        channel_type=cursor.int32(),
        channel_names=_texts(cursor),
    )


def _device(cursor: Cursor, _: BitstreamLayout) -> DeviceDescription:
    return DeviceDescription(
        id=cursor.int32(),
        name=cursor.text(),
        serial=cursor.text(),
        device_type=cursor.int32(),
        channel_type=cursor.int32(),
        channel_names=_texts(cursor),
    )


def _camera(cursor: Cursor, _: BitstreamLayout) -> CameraDescription:
    return CameraDescription(cursor.text(), cursor.floats(3), cursor.floats(4))


def _asset(cursor: Cursor, layout: BitstreamLayout) -> AssetDescription:
    return AssetDescription(
        name=cursor.text(),
        asset_type=cursor.int32(),
        id=cursor.int32(),
        bodies=_rigid_bodies(cursor, layout),
        markers=_asset_markers(cursor),
    )


def _asset_markers(cursor: Cursor) -> tuple[AssetMarkerDescription, ...]:
    count = cursor.count(_ASSET_MARKER_OCTETS)
    return tuple([_asset_marker(cursor) for _ in range(count)])


def _asset_marker(cursor: Cursor) -> AssetMarkerDescription:
    return AssetMarkerDescription(
        name=cursor.text(),
        id=cursor.int32(),
        position=cursor.floats(3),
        size=cursor.floats(1)[0],
        params=cursor.unpack(_PARAMS)[0],
    )


def _texts(cursor: Cursor) -> tuple[str, ...]:
    return cursor.texts(cursor.count(_NAME_OCTETS))


_READERS: dict[int, Callable[[Cursor, BitstreamLayout], Description]] = {
    0: _marker_set,
    1: _rigid_body,
    2: _skeleton,
    3: _force_plate,
    4: _device,
    5: _camera,
}
_ASSET_READERS = _READERS | {6: _asset}
