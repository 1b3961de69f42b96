"""Messages of every kind, as hypothesis draws them: any bits in any number, any bytes in any name."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import strategies as st

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
    DisconnectByTimeout,
    Discovery,
    EchoRequest,
    EchoResponse,
    KeepAlive,
    Message,
    MessageString,
    Request,
    RequestFrameOfData,
    RequestModelDef,
    Response,
    Sender,
    ServerInfo,
    Unknown,
    UnrecognizedRequest,
)
from retarget.udp.natnet.models import (
    AssetDescription,
    AssetMarkerDescription,
    CameraDescription,
    DescribedMarkers,
    Description,
    DeviceDescription,
    ForcePlateDescription,
    MarkerSetDescription,
    ModelDef,
    OpaqueDescription,
    RigidBodyDescription,
    SkeletonDescription,
    UnreadDescriptions,
)
from retarget.udp.natnet.records import BODY, MARKER, body_record, marker_record
from retarget.udp.natnet.text import text_from_octets
from retarget.udp.natnet.version import Bitstream, PrecisionForm, TimestampForm, layout_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from retarget.udp.natnet.version import BitstreamLayout

VERSIONS = [
    *(Bitstream(2, minor) for minor in range(5, 12)),
    *(Bitstream(3, minor) for minor in range(2)),
    *(Bitstream(4, minor) for minor in range(4)),
]

int32 = st.integers(-(2**31), 2**31 - 1)
uint8 = st.integers(0, 2**8 - 1)
uint16 = st.integers(0, 2**16 - 1)
uint32 = st.integers(0, 2**32 - 1)
uint64 = st.integers(0, 2**64 - 1)
names = st.one_of(st.sampled_from(["all", "Face", ""]), st.binary(max_size=12)).map(
    lambda name: name if isinstance(name, str) else text_from_octets(name.replace(b"\0", b""))
)
counts = st.integers(0, 4)
four_numbers = st.tuples(uint8, uint8, uint8, uint8)


@st.composite
def arrays(draw: st.DrawFn, kind: np.dtype[Any], *shape: int) -> NDArray[Any]:
    """Any bits in an array of this shape."""
    octets = kind.itemsize * int(np.prod(shape))
    return np.frombuffer(draw(st.binary(min_size=octets, max_size=octets)), kind).reshape(shape)


FLOAT = np.dtype("<f4")
INT = np.dtype("<i4")


@st.composite
def labelled(draw: st.DrawFn, record: np.dtype[np.void]) -> LabelledMarkers:
    return LabelledMarkers(draw(arrays(record, draw(counts))))


@st.composite
def body_markers(draw: st.DrawFn) -> BodyMarkers:
    n = draw(counts)
    return BodyMarkers(draw(arrays(FLOAT, n, 3)), draw(arrays(INT, n)), draw(arrays(FLOAT, n)))


@st.composite
def bodies(draw: st.DrawFn, layout: BitstreamLayout) -> RigidBodies:
    n = draw(counts)
    markers = tuple(draw(body_markers()) for _ in range(n)) if layout.rigid_body_markers else ()
    return RigidBodies(draw(arrays(body_record(layout), n)), markers)


@st.composite
def marker_sets(draw: st.DrawFn) -> MarkerSet:
    return MarkerSet(draw(names), draw(arrays(FLOAT, draw(counts), 3)))


@st.composite
def assets(draw: st.DrawFn) -> Asset:
    table = draw(arrays(BODY, draw(counts)))
    return Asset(draw(int32), RigidBodies(table), draw(labelled(MARKER)))


@st.composite
def analog(draw: st.DrawFn) -> AnalogSamples:
    return AnalogSamples(draw(int32), tuple(draw(arrays(FLOAT, draw(counts))) for _ in range(draw(counts))))


def tuples_of(entries: st.SearchStrategy[Any]) -> st.SearchStrategy[tuple[Any, ...]]:
    return st.lists(entries, max_size=3).map(tuple)


@st.composite
def frames(draw: st.DrawFn, version: Bitstream) -> FrameOfData:
    """A frame that holds what this version carries, and nothing else."""
    layout = layout_of(version)
    skeletons = st.builds(Skeleton, int32, bodies(layout))
    return FrameOfData(
        number=draw(int32),
        marker_sets=draw(tuples_of(marker_sets())),
        other_markers=draw(arrays(FLOAT, draw(counts), 3)),
        bodies=draw(bodies(layout)),
        skeletons=draw(tuples_of(skeletons)),
        assets=draw(tuples_of(assets())) if layout.assets else (),
        labelled=draw(labelled(marker_record(layout))),
        force_plates=draw(tuples_of(analog())) if layout.force_plates else (),
        devices=draw(tuples_of(analog())) if layout.devices else (),
        software_latency=draw(st.floats(width=32)) if layout.software_latency else None,
        timecode=draw(uint32),
        timecode_subframe=draw(uint32),
        timestamp_s=draw(_timestamps(layout)),
        ticks=draw(st.builds(Ticks, uint64, uint64, uint64)) if layout.ticks else None,
        precision=draw(_precisions(layout)),
        params=draw(uint16) if layout.params else 0,
    )


def _timestamps(layout: BitstreamLayout) -> st.SearchStrategy[float | None]:
    if layout.timestamp is TimestampForm.ABSENT:
        return st.none()
    return st.floats(width=32 if layout.timestamp is TimestampForm.FLOAT32 else 64)


def _precisions(layout: BitstreamLayout) -> st.SearchStrategy[PrecisionTime | None]:
    given = st.builds(PrecisionTime, uint32, uint32)
    if layout.precision is PrecisionForm.PRESENT:
        return given
    return st.none() if layout.precision is PrecisionForm.ABSENT else st.none() | given


@st.composite
def described_markers(draw: st.DrawFn, layout: BitstreamLayout) -> DescribedMarkers:
    n = draw(counts)
    titles = tuple(draw(names) for _ in range(n)) if layout.described_marker_names else ()
    return DescribedMarkers(draw(arrays(FLOAT, n, 3)), draw(arrays(INT, n)), titles)


@st.composite
def described_bodies(draw: st.DrawFn, layout: BitstreamLayout) -> RigidBodyDescription:
    return RigidBodyDescription(
        draw(names),
        draw(int32),
        draw(int32),
        draw(arrays(FLOAT, 3)),
        draw(arrays(FLOAT, 4)) if layout.described_rotation else None,
        draw(described_markers(layout)) if layout.described_markers else None,
    )


@st.composite
def described_plates(draw: st.DrawFn) -> ForcePlateDescription:
    calibration = np.tile(draw(arrays(FLOAT, 12)), (12, 1))
    sizes = draw(arrays(FLOAT, 2)), draw(arrays(FLOAT, 3)), calibration, draw(arrays(FLOAT, 4, 3))
    return ForcePlateDescription(draw(int32), draw(names), *sizes, draw(int32), draw(int32), draw(tuples_of(names)))


@st.composite
def described_assets(draw: st.DrawFn, layout: BitstreamLayout) -> AssetDescription:
    marker = st.builds(
        AssetMarkerDescription, names, int32, arrays(FLOAT, 3), arrays(FLOAT, 1).map(lambda a: a[0]), uint16
    )
    parts = draw(tuples_of(described_bodies(layout))), draw(tuples_of(marker))
    return AssetDescription(draw(names), draw(int32), draw(int32), *parts)


def descriptions(layout: BitstreamLayout) -> st.SearchStrategy[Description]:
    kinds: list[st.SearchStrategy[Description]] = [
        st.builds(MarkerSetDescription, names, tuples_of(names)),
        described_bodies(layout),
        st.builds(SkeletonDescription, names, int32, tuples_of(described_bodies(layout))),
        described_plates(),
        st.builds(DeviceDescription, int32, names, names, int32, int32, tuples_of(names)),
        st.builds(CameraDescription, names, arrays(FLOAT, 3), arrays(FLOAT, 4)),
    ]
    if layout.assets:
        kinds.append(described_assets(layout))
        kinds.append(st.builds(OpaqueDescription, st.integers(7, 2**31 - 1), st.binary(max_size=20)))
    return st.one_of(kinds)


@st.composite
def models(draw: st.DrawFn, version: Bitstream) -> ModelDef:
    """A model definition that holds what this version carries, and nothing else."""
    layout = layout_of(version)
    read = draw(tuples_of(descriptions(layout)))
    if layout.section_sizes or draw(st.booleans()):
        return ModelDef(read)
    kind = draw(st.integers(7, 2**31 - 1)).to_bytes(4, "little")
    rest = draw(st.binary(max_size=20))
    return ModelDef(read, UnreadDescriptions(draw(st.integers(1, 1 + len(rest) // 4)), kind + rest))


senders = st.builds(Sender, st.binary(min_size=256, max_size=256), four_numbers, four_numbers)
options = st.builds(ConnectionOptions, uint8, four_numbers)
groups = st.tuples(uint8, uint8, uint8, uint8).map(lambda parts: ".".join(map(str, parts)))
connections = st.builds(ConnectionInfo, uint64, uint16, uint8, groups)
payloads = st.binary(max_size=40)
greetings = st.just(b"") | st.binary(max_size=20).map(lambda octets: octets.replace(b"\0", b"") + b"\0")
nuls = st.integers(0, 8).map(bytes)


def _hellos(kind: Callable[..., Any]) -> st.SearchStrategy[Any]:
    return st.one_of(
        st.builds(kind, extra=greetings), st.builds(kind, senders), st.builds(kind, senders, options, nuls)
    )


def _bare(kind: Callable[..., Any]) -> st.SearchStrategy[Any]:
    return st.builds(kind, st.sampled_from([b"", b"\0"]))


commands: st.SearchStrategy[Message] = st.one_of(
    _hellos(Connect),
    _hellos(Discovery),
    st.builds(ServerInfo, senders, st.none() | connections),
    *(st.builds(kind, payloads) for kind in (Request, Response, MessageString, UnrecognizedRequest)),
    *(_bare(kind) for kind in (RequestModelDef, RequestFrameOfData, Disconnect, KeepAlive, DisconnectByTimeout)),
    st.builds(EchoRequest, uint64),
    st.builds(EchoResponse, uint64, uint64),
    st.builds(Unknown, st.integers(15, 99) | st.integers(101, 2**16 - 1), payloads),
)

EXTREMES = [struct.pack("<i", n) for n in (-1, -(2**31), 2**31 - 1, 0, 1, 255, 65535, 2**24)]
"""What a hostile sender writes where a count or a size is expected."""
