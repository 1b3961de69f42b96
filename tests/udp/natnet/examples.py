"""Messages with something in every field, for tests that cut, bend and compare them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

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
from retarget.udp.natnet.messages import (
    Connect,
    ConnectionInfo,
    ConnectionOptions,
    Disconnect,
    Discovery,
    EchoRequest,
    EchoResponse,
    KeepAlive,
    Message,
    MessageString,
    Request,
    RequestModelDef,
    Response,
    Sender,
    ServerInfo,
    UnrecognizedRequest,
)
from retarget.udp.natnet.models import (
    AssetDescription,
    AssetMarkerDescription,
    CameraDescription,
    DescribedMarkers,
    DeviceDescription,
    ForcePlateDescription,
    MarkerSetDescription,
    ModelDef,
    RigidBodyDescription,
    SkeletonDescription,
)
from retarget.udp.natnet.records import BODY, MARKER
from retarget.udp.natnet.version import Bitstream, layout_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

SENDER = Sender.named("Motive", (3, 1, 2, 1), (4, 1, 0, 0))
FLOAT = np.dtype("<f4")
INT = np.dtype("<i4")


def points(count: int, start: float) -> NDArray[np.float32]:
    """Points that are all different, (count, 3)."""
    return np.arange(3 * count, dtype=FLOAT).reshape(count, 3) / np.float32(64) + np.float32(start)


def markers_of(count: int, start: float) -> LabelledMarkers:
    """Labelled markers, one occluded, one unlabelled."""
    table = np.zeros(count, MARKER)
    table["id"] = (3 << 16) + np.arange(1, count + 1)
    table["position"] = points(count, start)
    table["size"] = 0.004
    table["params"] = 10
    table["params"][0] = 5
    table["params"][-1] = 18
    table["residual"] = 3e-4
    return LabelledMarkers(table)


def bodies_of(count: int, start: float, version: Bitstream) -> RigidBodies:
    """Rigid bodies, before 3.0 with three markers each."""
    table = np.zeros(count, BODY)
    table["id"] = np.arange(1, count + 1)
    table["position"] = points(count, start)
    table["quat_xyzw"] = [0.5, -0.5, 0.5, 0.5]
    table["error"] = 1e-4
    table["params"] = 1
    with_markers = layout_of(version).rigid_body_markers
    own = BodyMarkers(points(3, start), np.arange(3, dtype=INT), np.full(3, 0.01, FLOAT))
    return RigidBodies(table, (own,) * count if with_markers else ())


def face_frame() -> FrameOfData:
    """24 labelled markers, in two marker sets and a rigid body, as a facial session sends them."""
    markers = markers_of(24, 0.5)
    return FrameOfData(
        number=1234,
        marker_sets=(MarkerSet("Face", markers.positions), MarkerSet("all", markers.positions)),
        bodies=bodies_of(1, 1.0, Bitstream(4, 1)),
        labelled=markers,
        timecode=0x01020304,
        timestamp_s=12.25,
        ticks=Ticks(100, 200, 300),
        precision=PrecisionTime(77, 2**31),
        params=2,
    )


def rich_frame(version: Bitstream) -> FrameOfData:
    """Something in every section that this version has."""
    layout = layout_of(version)
    box = AnalogSamples(4, (np.arange(3, dtype=FLOAT), np.arange(2, dtype=FLOAT)))
    return FrameOfData(
        number=4711,
        marker_sets=(MarkerSet("Face", points(4, 0.5)), MarkerSet("all", points(5, 0.5))),
        other_markers=points(2, 5.0),
        bodies=bodies_of(2, 1.0, version),
        skeletons=(Skeleton(2, bodies_of(3, 2.0, version)),),
        assets=(Asset(9, bodies_of(2, 3.0, version), markers_of(2, 4.0)),) if layout.assets else (),
        labelled=markers_of(5, 0.5),
        force_plates=(box,) if layout.force_plates else (),
        devices=(box, box) if layout.devices else (),
        software_latency=0.25,
        timecode=0x0A0B0C0D,
        timecode_subframe=3,
        timestamp_s=98.5,
        ticks=Ticks(10**12, 10**12 + 5, 10**12 + 9),
        precision=PrecisionTime(1_700_000_001, 3 * 2**30 + 1),
        params=3,
    )


def rich_models(version: Bitstream) -> ModelDef:
    """A description of every type that this version has."""
    band = _described_body("Band", 7)
    return ModelDef(
        (
            MarkerSetDescription("Face", ("browInnerLeft", "browInnerRight", "lipUpper", "chin")),
            MarkerSetDescription("all", ("browInnerLeft", "browInnerRight", "lipUpper", "chin", "loose")),
            band,
            SkeletonDescription("Ana", 2, (band, _described_body("Neck", 8))),
            _described_plate(),
            DeviceDescription(5, "Glove", "G-1", 1, 2, ("thumb", "index")),
            CameraDescription("Prime 13", np.arange(3, dtype=FLOAT), np.arange(4, dtype=FLOAT)),
            *((_described_asset(band),) if layout_of(version).assets else ()),
        )
    )


def _described_body(name: str, number: int) -> RigidBodyDescription:
    markers = DescribedMarkers(points(2, 0.25), np.array([0, 3], INT), ("left", "right"))
    return RigidBodyDescription(name, number, -1, np.arange(3, dtype=FLOAT), np.array([0, 0, 0.6, 0.8], FLOAT), markers)


def _described_plate() -> ForcePlateDescription:
    return ForcePlateDescription(
        id=1,
        serial="F-1",
        size=np.arange(2, dtype=FLOAT),
        origin=np.arange(3, dtype=FLOAT),
        calibration=np.arange(144, dtype=FLOAT).reshape(12, 12),
        corners=points(4, 0.125),
        plate_type=2,
        channel_type=0,
        channel_names=("Fx", "Fy", "Fz"),
    )


def _described_asset(band: RigidBodyDescription) -> AssetDescription:
    marker = AssetMarkerDescription("chin", 3, np.arange(3, dtype=FLOAT), np.float32(0.004), 8)
    return AssetDescription("Jacket", 1, 9, (band,), (marker, marker))


def every_command() -> tuple[Message, ...]:
    """Every message that is the same in all versions."""
    return (
        Connect(),
        Connect(extra=b"Ping\0"),
        Connect(SENDER),
        Connect(SENDER, ConnectionOptions(0, (4, 1, 0, 0)), bytes(2)),
        Discovery(SENDER),
        ServerInfo(SENDER),
        ServerInfo(SENDER, ConnectionInfo(10_000_000, 1511, 1, "239.255.42.99")),
        Request.of("SetPlaybackCurrentFrame", 250),
        Response.of_float32(120.0),
        Response.of_text("Bitstream,4.1"),
        RequestModelDef(),
        KeepAlive(b"\0"),
        Disconnect(),
        MessageString(b"hello\0"),
        EchoRequest(2**63 + 5),
        EchoResponse(2**63 + 5, 7),
        UnrecognizedRequest(bytes(264)),
    )
