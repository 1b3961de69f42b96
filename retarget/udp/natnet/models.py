"""MODELDEF as values: what the markers and rigid bodies of the frames are called.

Lengths in metres, quaternions xyzw, in the server's own axes. Source: NatNetTypes.h of the vendor's SDKs 2.5 to 4.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

NO_PARENT = -1


@dataclass(frozen=True, slots=True)
class MarkerSetDescription:
    """Names of the markers of the `MarkerSet` of the same name, in its order (type 0)."""

    name: str
    marker_names: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class DescribedMarkers:
    """Where a rigid body's markers are (from 3.0)."""

    positions: NDArray[np.float32]
    """(n, 3) [m], in the rigid body."""
    active_labels: NDArray[np.int32]
    """(n,), 0 for a passive marker."""
    names: tuple[str, ...] = ()
    """One each from 4.0, else empty."""


@dataclass(frozen=True, slots=True, eq=False)
class RigidBodyDescription:
    """A rigid body, or a bone (type 1)."""

    name: str
    id: int
    parent_id: int
    """-1 where it has none."""
    offset: NDArray[np.float32]
    """(3,) [m], relative to the parent."""
    rotation_xyzw: NDArray[np.float32] | None = None
    """(4,), relative to the parent; from 4.2."""
    markers: DescribedMarkers | None = None
    """From 3.0."""


@dataclass(frozen=True, slots=True, eq=False)
class SkeletonDescription:
    """A skeleton and its bones (type 2)."""

    name: str
    id: int
    bones: tuple[RigidBodyDescription, ...]


@dataclass(frozen=True, slots=True, eq=False)
class ForcePlateDescription:
    """A force plate (type 3)."""

    id: int
    serial: str
    size: NDArray[np.float32]
    """(2,) width and length [m]."""
    origin: NDArray[np.float32]
    """(3,) [m]."""
    calibration: NDArray[np.float32]
    """(12, 12)."""
    corners: NDArray[np.float32]
    """(4, 3) [m]."""
    plate_type: int
    channel_type: int
    channel_names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class DeviceDescription:
    """An analog device (type 4)."""

    id: int
    name: str
    serial: str
    device_type: int
    channel_type: int
    channel_names: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class CameraDescription:
    """A camera (type 5)."""

    name: str
    position: NDArray[np.float32]
    """(3,) [m]."""
    quat_xyzw: NDArray[np.float32]
    """(4,)."""


@dataclass(frozen=True, slots=True, eq=False)
class AssetMarkerDescription:
    """A marker of a trained asset."""

    name: str
    id: int
    position: NDArray[np.float32]
    """(3,) [m]."""
    size: np.float32
    """Diameter [m]."""
    params: int


@dataclass(frozen=True, slots=True, eq=False)
class AssetDescription:
    """A trained asset (type 6, from 4.1)."""

    name: str
    asset_type: int
    """1 is a trained marker set."""
    id: int
    bodies: tuple[RigidBodyDescription, ...]
    markers: tuple[AssetMarkerDescription, ...]


@dataclass(frozen=True, slots=True)
class OpaqueDescription:
    """A description skipped by its size (from 4.1): its type is unknown, or its body does not follow its type."""

    type: int
    body: bytes


Description: TypeAlias = (
    MarkerSetDescription
    | RigidBodyDescription
    | SkeletonDescription
    | ForcePlateDescription
    | DeviceDescription
    | CameraDescription
    | AssetDescription
    | OpaqueDescription
)


@dataclass(frozen=True, slots=True)
class UnreadDescriptions:
    """The rest of a definition before 4.1, from the first description on whose type, and so its end, is unknown."""

    count: int
    """How many descriptions it holds."""
    octets: bytes
    """Their bytes; the first four are the unknown type."""


@dataclass(frozen=True, slots=True, eq=False)
class ModelDef:
    """MODELDEF (5)."""

    descriptions: tuple[Description, ...] = ()
    unread: UnreadDescriptions | None = None

    @property
    def marker_sets(self) -> tuple[MarkerSetDescription, ...]:
        """The marker sets among the descriptions."""
        return tuple(d for d in self.descriptions if isinstance(d, MarkerSetDescription))

    @property
    def rigid_bodies(self) -> tuple[RigidBodyDescription, ...]:
        """The rigid bodies among the descriptions; not the bones of skeletons and assets."""
        return tuple(d for d in self.descriptions if isinstance(d, RigidBodyDescription))

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence about everything that could not be read."""
        opaque = [d for d in self.descriptions if isinstance(d, OpaqueDescription)]
        notes = [
            f"A description of type {d.type} ({len(d.body)} bytes) is not understood and was skipped." for d in opaque
        ]
        if self.unread is not None:
            kind = int.from_bytes(self.unread.octets[:4], "little", signed=True)
            notes.append(
                f"The last {self.unread.count} descriptions ({len(self.unread.octets)} bytes) could not be read: "
                f"the first of them is of unknown type {kind}."
            )
        return tuple(notes)
