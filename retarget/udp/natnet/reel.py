"""What a server plays: frames in order, when each is due, and what their markers are called."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from retarget.errors import InputError
from retarget.udp.natnet.catalogue import EVERYTHING
from retarget.udp.natnet.framedata import FrameOfData, LabelledMarkers, MarkerSet
from retarget.udp.natnet.models import MarkerSetDescription, ModelDef
from retarget.udp.natnet.records import MARKER, FrameFlag, MarkerFlag

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame, MarkerLayout

MAX_MARKERS = 1000
"""Labelled markers in a frame that the vendor's clients have room for."""
_ASSET_ID = 1
_SIZE_M = 0.004
_RESIDUAL_M = 0.0002
_SEEN = MarkerFlag.POINT_CLOUD_SOLVED | MarkerFlag.HAS_MODEL
_NOT_SEEN = MarkerFlag.OCCLUDED | MarkerFlag.HAS_MODEL
_LOOSE = MarkerFlag.POINT_CLOUD_SOLVED | MarkerFlag.UNLABELLED


class Reel(Protocol):
    """Frames that can be played from anywhere, forwards, in any bitstream."""

    @property
    def definitions(self) -> ModelDef:
        """Names of all markers, the same for the whole reel."""

    @property
    def rate_hz(self) -> float:
        """Nominal frames per second."""

    @property
    def times_s(self) -> NDArray[np.float64]:
        """(N,) when each frame is due, from any origin, never decreasing [s]."""

    def frame(self, index: int) -> FrameOfData:
        """Frame at `index`; its ticks are the server's to set."""


class MarkerReel:
    """Marker frames as one marker set called `subject`.

    A marker that was not seen (NaN) is sent as an occluded labelled marker, and as (0, 0, 0) in the marker sets, which
    have no flags. `rate_hz` defaults to the frames' own times. Raises `InputError` for no frames, too many markers, or
    frames of different layouts.
    """

    def __init__(self, frames: Sequence[MarkerFrame], subject: str = "face", rate_hz: float | None = None) -> None:
        if not frames:
            raise InputError("There is nothing to serve: the take has no frames.")
        self._frames = frames
        self._layout = _common_layout(frames)
        self._subject = subject if subject != EVERYTHING else f"{subject}_"
        self._times_s = np.maximum.accumulate(np.array([frame.time_s for frame in frames]))
        self._rate_hz = rate_hz if rate_hz is not None else _rate_hz(self._times_s)
        self._ids = _ASSET_ID << 16 | np.arange(1, len(self._layout.names) + 1)

    @property
    def definitions(self) -> ModelDef:
        """The marker set, and "all"."""
        names = self._layout.names
        return ModelDef((MarkerSetDescription(self._subject, names), MarkerSetDescription(EVERYTHING, names)))

    @property
    def rate_hz(self) -> float:
        """Nominal frames per second."""
        return self._rate_hz

    @property
    def times_s(self) -> NDArray[np.float64]:
        """(N,) [s]."""
        return self._times_s

    def frame(self, index: int) -> FrameOfData:
        """Frame at `index`."""
        frame = self._frames[index]
        positions = np.nan_to_num(frame.positions, nan=0.0).astype("<f4")
        loose = np.zeros((0, 3)) if frame.unlabelled is None else frame.unlabelled
        return FrameOfData(
            number=frame.number,
            marker_sets=(MarkerSet(self._subject, positions), MarkerSet(EVERYTHING, positions)),
            other_markers=loose.astype("<f4"),
            labelled=LabelledMarkers(self._labelled(frame.positions, positions, loose)),
            timestamp_s=frame.time_s,
            params=FrameFlag.EDIT_MODE,
        )

    def _labelled(
        self, given: NDArray[np.float64], positions: NDArray[np.float32], loose: NDArray[np.float64]
    ) -> NDArray[np.void]:
        count = len(positions)
        table = np.zeros(min(count + len(loose), MAX_MARKERS), MARKER)
        seen = np.isfinite(given[:, 0]) & np.isfinite(given[:, 1]) & np.isfinite(given[:, 2])
        table["id"][:count] = self._ids
        table["position"][:count] = np.where(seen[:, None], positions, 0)
        table["params"][:count] = np.where(seen, _SEEN, _NOT_SEEN)
        table["residual"][:count] = np.where(seen, _RESIDUAL_M, 0.0)
        rest = len(table) - count
        table["id"][count:] = np.arange(1, rest + 1)
        table["position"][count:] = loose[:rest]
        table["params"][count:] = _LOOSE
        table["residual"][count:] = _RESIDUAL_M
        table["size"] = _SIZE_M
        return table


def _common_layout(frames: Sequence[MarkerFrame]) -> MarkerLayout:
    layout = frames[0].layout
    if any(frame.layout is not layout and frame.layout.names != layout.names for frame in frames):
        raise InputError("The frames of a take that is served must all have the same markers.")
    if len(layout.names) > MAX_MARKERS:
        raise InputError(f"{len(layout.names)} markers are too many to serve; NatNet clients take {MAX_MARKERS}.")
    return layout


def _rate_hz(times_s: NDArray[np.float64]) -> float:
    steps = np.diff(times_s)
    steps = steps[steps > 0]
    return float(1.0 / np.median(steps)) if len(steps) else 1.0
