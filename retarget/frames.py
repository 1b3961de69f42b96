"""The values that cross packages: what the markers are, where they are, and how the face stands.

Frames: ``world`` is the capture volume, ``head`` the skull: origin at the rest position of the rig's head joint, +Y
up, +Z out of the face, +X to the performer's left, in the performer's own metres. Missing data has one meaning: NaN.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class MarkerLayout:
    """Which markers there are, in the order of every array of a frame."""

    name: str
    names: tuple[str, ...]
    """One unique name per marker, (M,)."""
    sites: tuple[str, ...] = ()
    """The rig site that each marker drives, "" where it drives none; (M,), or empty when nothing is known of the
    rig.
    """
    head: tuple[int, ...] = ()
    """Indices of the markers that move with the skull alone and so carry the head's motion."""
    rest: NDArray[np.float64] | None = None
    """Optional positions of a typical neutral face, (M, 3) [m], ``head``."""


@dataclass(frozen=True, slots=True, eq=False)
class MarkerFrame:
    """All markers at one instant."""

    number: int
    """The sender's frame number."""
    time_s: float
    """Instant of the exposure: the sender's clock mapped to the local monotonic clock [s]; a file's own time for a
    file.
    """
    received_s: float
    """Local monotonic time at which the frame arrived [s]; equal to `time_s` for a file."""
    layout: MarkerLayout
    positions: NDArray[np.float64]
    """(M, 3) [m]; a NaN row is a marker that was not seen. In ``world``, or in ``head`` once `T_world_head` is
    given.
    """
    T_world_head: NDArray[np.float64] | None = None
    """(4, 4), set by the stabilising stage, which takes `positions` from ``world`` to ``head``."""
    unlabelled: NDArray[np.float64] | None = None
    """(U, 3) [m], ``world``: points seen that carry no name."""


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """How the rig stands at one instant."""

    number: int
    """Frame number of the markers it was solved from."""
    time_s: float
    """As in the `MarkerFrame` [s]."""
    received_s: float
    """As in the `MarkerFrame` [s]."""
    T_world_head: NDArray[np.float64]
    """(4, 4): the performer's head in the capture volume."""
    translations: NDArray[np.float64]
    """(J, 3) [m], each joint relative to its parent, in the order of the rig's joints."""
    rotations: NDArray[np.float64]
    """(J, 4) unit quaternions xyzw, each joint relative to its parent."""
    weights: NDArray[np.float64]
    """(B,) in [0, 1], in the order of the rig's blend shapes."""
