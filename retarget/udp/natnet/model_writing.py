"""MODELDEF to bytes: bitstream 2.5 to 4.3.

A definition read from one version can be written in another: what the other does not carry is left out, what it adds is
empty, no rotation and no name.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError
from retarget.udp.natnet.models import (
    AssetDescription,
    CameraDescription,
    DescribedMarkers,
    DeviceDescription,
    ForcePlateDescription,
    MarkerSetDescription,
    OpaqueDescription,
    RigidBodyDescription,
    SkeletonDescription,
)
from retarget.udp.natnet.records import FLOAT, INT
from retarget.udp.natnet.writer import Writer

if TYPE_CHECKING:
    from retarget.udp.natnet.models import AssetMarkerDescription, Description, ModelDef
    from retarget.udp.natnet.version import BitstreamLayout

_PARAMS = struct.Struct("<H")
_NO_ROTATION = np.array([0, 0, 0, 1], FLOAT)
_NO_MARKERS = DescribedMarkers(np.empty((0, 3), FLOAT), np.empty(0, INT))


def write_model_def(out: Writer, models: ModelDef, layout: BitstreamLayout) -> None:
    """Write the payload of a MODELDEF; raise `InputError` for a value that does not fit."""
    carried = [d for d in models.descriptions if _carries(layout, d)]
    unread = models.unread
    if unread is not None and layout.section_sizes:
        raise InputError(f"Descriptions that were not understood cannot be written as bitstream {layout.version}.")
    out.int32(len(carried) + (unread.count if unread else 0))
    for description in carried:
        _write_description(out, description, layout)
    if unread is not None:
        out.octets(unread.octets)


def _carries(layout: BitstreamLayout, description: Description) -> bool:
    return layout.section_sizes or not isinstance(description, OpaqueDescription | AssetDescription)


def _write_description(out: Writer, description: Description, layout: BitstreamLayout) -> None:
    body = Writer()
    kind = _write_body(body, description, layout)
    octets = body.getvalue()
    out.int32(kind)
    if layout.section_sizes:
        out.int32(len(octets))
    out.octets(octets)


def _write_body(out: Writer, description: Description, layout: BitstreamLayout) -> int:
    """Write what the type's own writer says; return the number of the type."""
    match description:
        case MarkerSetDescription():
            out.text(description.name)
            _texts(out, description.marker_names)
            return 0
        case RigidBodyDescription():
            _rigid_body(out, description, layout)
            return 1
        case SkeletonDescription():
            _skeleton(out, description, layout)
            return 2
        case ForcePlateDescription():
            _force_plate(out, description)
            return 3
        case DeviceDescription():
            _device(out, description)
            return 4
        case CameraDescription():
            _camera(out, description)
            return 5
        case AssetDescription():
            _asset(out, description, layout)
            return 6
        case OpaqueDescription():
            out.octets(description.body)
            return description.type


def _rigid_body(out: Writer, body: RigidBodyDescription, layout: BitstreamLayout) -> None:
    out.text(body.name)
    out.int32(body.id)
    out.int32(body.parent_id)
    out.floats(body.offset, 3)
    if layout.described_rotation:
        out.floats(_NO_ROTATION if body.rotation_xyzw is None else body.rotation_xyzw, 4)
    if layout.described_markers:
        _described_markers(out, body.markers or _NO_MARKERS, layout)


def _described_markers(out: Writer, markers: DescribedMarkers, layout: BitstreamLayout) -> None:
    count = len(markers.positions)
    out.int32(count)
    out.floats(markers.positions, count, 3)
    out.ints(markers.active_labels, count)
    if layout.described_marker_names:
        names = markers.names or ("",) * count
        if len(names) != count:
            raise InputError(f"A rigid body has {count} markers and {len(names)} marker names; give one each.")
        out.texts(names)


def _skeleton(out: Writer, skeleton: SkeletonDescription, layout: BitstreamLayout) -> None:
    out.text(skeleton.name)
    out.int32(skeleton.id)
    out.int32(len(skeleton.bones))
    for bone in skeleton.bones:
        _rigid_body(out, bone, layout)


def _force_plate(out: Writer, plate: ForcePlateDescription) -> None:
    out.int32(plate.id)
    out.text(plate.serial)
    out.floats(plate.size, 2)
    out.floats(plate.origin, 3)
    out.floats(plate.calibration, 12, 12)
    out.floats(plate.corners, 4, 3)
    out.int32(plate.plate_type)
    out.int32(plate.channel_type)
    _texts(out, plate.channel_names)


def _device(out: Writer, device: DeviceDescription) -> None:
    out.int32(device.id)
    out.text(device.name)
    out.text(device.serial)
    out.int32(device.device_type)
    out.int32(device.channel_type)
    _texts(out, device.channel_names)


def _camera(out: Writer, camera: CameraDescription) -> None:
    out.text(camera.name)
    out.floats(camera.position, 3)
    out.floats(camera.quat_xyzw, 4)


def _asset(out: Writer, asset: AssetDescription, layout: BitstreamLayout) -> None:
    out.text(asset.name)
    out.int32(asset.asset_type)
    out.int32(asset.id)
    out.int32(len(asset.bodies))
    for body in asset.bodies:
        _rigid_body(out, body, layout)
    out.int32(len(asset.markers))
    for marker in asset.markers:
        _asset_marker(out, marker)


def _asset_marker(out: Writer, marker: AssetMarkerDescription) -> None:
    out.text(marker.name)
    out.int32(marker.id)
    out.floats(marker.position, 3)
    out.floats(np.asarray(marker.size, FLOAT))
    out.pack(_PARAMS, marker.params)


def _texts(out: Writer, texts: tuple[str, ...]) -> None:
    out.int32(len(texts))
    out.texts(texts)
