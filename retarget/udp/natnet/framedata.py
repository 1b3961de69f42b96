"""FRAMEOFDATA as values: all that a server says about one instant.

Positions are metres in the server's own axes (as its streaming settings have them), quaternions xyzw. Arrays that come
from a datagram are read-only views of it. A value holds what its bitstream carried; what a version does not carry is
None, zero flags or NaN residuals. Source: NatNetTypes.h of the vendor's SDKs 2.5 to 4.3, checked against captured
datagrams.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from retarget.udp.natnet.records import BODY, MARKER, NO_POSITIONS, BodyFlag, FrameFlag, MarkerFlag, column

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class MarkerSet:
    """The markers of one asset, or of all under the name "all"; the model definition has names in the same order."""

    name: str
    positions: NDArray[np.float32]
    """(n, 3) [m]; an occluded marker is not told apart here, see `LabelledMarkers`."""


@dataclass(frozen=True, slots=True, eq=False)
class LabelledMarkers:
    """All labelled markers of a frame (or all markers of an asset), one record each."""

    table: NDArray[np.void]
    """(n,) records of one of the types of `records`."""

    def __len__(self) -> int:
        return len(self.table)

    @property
    def ids(self) -> NDArray[np.int32]:
        """(n,): active id, or asset id << 16 | member id, or a point-cloud id that changes after each loss."""
        return self.table["id"]

    @property
    def model_ids(self) -> NDArray[np.int32]:
        """(n,): upper half of `ids`, 0 for a marker of no asset."""
        return self.ids >> 16

    @property
    def member_ids(self) -> NDArray[np.int32]:
        """(n,): lower half of `ids`: from 1 within an asset, in the order of its marker names."""
        return self.ids & 0xFFFF

    @property
    def positions(self) -> NDArray[np.float32]:
        """(n, 3) [m]; of an occluded marker filled in or stale."""
        return self.table["position"]

    @property
    def sizes(self) -> NDArray[np.float32]:
        """(n,) diameters [m]."""
        return self.table["size"]

    @property
    def params(self) -> NDArray[np.uint16]:
        """(n,) of `MarkerFlag`; zeros in 2.5."""
        return column(self.table, "params", 0)

    @property
    def residuals(self) -> NDArray[np.float32]:
        """(n,) [m/ray]; NaN before 3.0."""
        return column(self.table, "residual", np.nan)

    @property
    def occluded(self) -> NDArray[np.bool_]:
        """(n,): not seen in this frame."""
        return self._flag(MarkerFlag.OCCLUDED)

    @property
    def point_cloud_solved(self) -> NDArray[np.bool_]:
        """(n,): triangulated from this frame's rays."""
        return self._flag(MarkerFlag.POINT_CLOUD_SOLVED)

    @property
    def model_filled(self) -> NDArray[np.bool_]:
        """(n,): the position was derived from the asset, not measured."""
        return self._flag(MarkerFlag.MODEL_FILLED)

    @property
    def unlabelled(self) -> NDArray[np.bool_]:
        """(n,): seen, but of no asset (from 3.0)."""
        return self._flag(MarkerFlag.UNLABELLED)

    @property
    def measured(self) -> NDArray[np.bool_]:
        """(n,): seen in this frame; neither occluded nor filled in from a model."""
        return ~self._flag(MarkerFlag.OCCLUDED | MarkerFlag.MODEL_FILLED)

    def _flag(self, flag: MarkerFlag) -> NDArray[np.bool_]:
        raised: NDArray[np.bool_] = (self.params & flag) != 0
        return raised


@dataclass(frozen=True, slots=True, eq=False)
class BodyMarkers:
    """The markers that travelled with one rigid body before 3.0."""

    positions: NDArray[np.float32]
    """(n, 3) [m]."""
    ids: NDArray[np.int32]
    """(n,)."""
    sizes: NDArray[np.float32]
    """(n,) [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class RigidBodies:
    """All rigid bodies of a frame, of a skeleton or of an asset, one record each."""

    table: NDArray[np.void]
    """(n,) records of one of the types of `records`."""
    markers: tuple[BodyMarkers, ...] = ()
    """Before 3.0 one per rigid body, else empty."""

    def __len__(self) -> int:
        return len(self.table)

    @property
    def ids(self) -> NDArray[np.int32]:
        """(n,); of a bone: skeleton id << 16 | bone id."""
        return self.table["id"]

    @property
    def positions(self) -> NDArray[np.float32]:
        """(n, 3) [m]."""
        return self.table["position"]

    @property
    def quats_xyzw(self) -> NDArray[np.float32]:
        """(n, 4)."""
        return self.table["quat_xyzw"]

    @property
    def errors(self) -> NDArray[np.float32]:
        """(n,) mean distance of the markers from where the body says they are [m]."""
        return self.table["error"]

    @property
    def params(self) -> NDArray[np.uint16]:
        """(n,) of `BodyFlag`; zeros in 2.5."""
        return column(self.table, "params", 0)

    @property
    def tracked(self) -> NDArray[np.bool_]:
        """(n,): found in this frame (from 2.6)."""
        tracked: NDArray[np.bool_] = (self.params & BodyFlag.TRACKED) != 0
        return tracked


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """One skeleton of a frame."""

    id: int
    bones: RigidBodies


@dataclass(frozen=True, slots=True, eq=False)
class Asset:
    """One trained asset of a frame (from 4.1)."""

    id: int
    bodies: RigidBodies
    markers: LabelledMarkers


@dataclass(frozen=True, slots=True, eq=False)
class AnalogSamples:
    """One force plate or device: for every channel the samples since the last frame."""

    id: int
    channels: tuple[NDArray[np.float32], ...]


class Ticks(NamedTuple):
    """The server's high-resolution clock; its frequency is in the SERVERINFO."""

    mid_exposure: int
    """Middle of the cameras' exposure."""
    received: int
    """The cameras' data had reached the server."""
    transmit: int
    """The frame left the server."""


class PrecisionTime(NamedTuple):
    """Precision time stamp of the cameras' own clock (from 4.1; in some streams of 4.0)."""

    seconds: int
    fraction: int
    """In parts of 2**32 of a second."""


NO_MARKERS = LabelledMarkers(np.empty(0, MARKER))
NO_BODIES = RigidBodies(np.empty(0, BODY))


@dataclass(frozen=True, slots=True, eq=False)
class FrameOfData:
    """FRAMEOFDATA (7)."""

    number: int
    marker_sets: tuple[MarkerSet, ...] = ()
    other_markers: NDArray[np.float32] = field(default_factory=lambda: NO_POSITIONS)
    """(n, 3) [m]: markers of no asset, the older way of telling (`labelled` has them too, as unlabelled, from 3.0)."""
    bodies: RigidBodies = NO_BODIES
    skeletons: tuple[Skeleton, ...] = ()
    assets: tuple[Asset, ...] = ()
    labelled: LabelledMarkers = NO_MARKERS
    force_plates: tuple[AnalogSamples, ...] = ()
    devices: tuple[AnalogSamples, ...] = ()
    software_latency: float | None = None
    """Before 3.0; a sender's own measure, not always seconds."""
    timecode: int = 0
    """SMPTE time code: hours, minutes, seconds and frames, a byte each from the top."""
    timecode_subframe: int = 0
    timestamp_s: float | None = None
    """Seconds since the server started; from 2.6."""
    ticks: Ticks | None = None
    """From 3.0."""
    precision: PrecisionTime | None = None
    params: int = 0
    """Of `FrameFlag`; from 2.6."""

    @property
    def recording(self) -> bool:
        """The server is recording."""
        return bool(self.params & FrameFlag.RECORDING)

    @property
    def models_changed(self) -> bool:
        """The model definitions should be asked for again."""
        return bool(self.params & FrameFlag.MODELS_CHANGED)

    @property
    def edit_mode(self) -> bool:
        """Played back from a file, not live."""
        return bool(self.params & FrameFlag.EDIT_MODE)

    @property
    def bitstream_changed(self) -> bool:
        """The server changed its bitstream: connect again."""
        return bool(self.params & FrameFlag.BITSTREAM_CHANGED)
