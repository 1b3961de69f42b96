"""A take in memory as arrays, under the names of a layout, whatever source it came from. Metres, seconds, ``world``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError
from retarget.markers.label import Labeller
from retarget.markers.layouts import detect_layout
from retarget.sources import open_source

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame, MarkerLayout
    from retarget.markers.layouts import Layout

    Array = NDArray[np.float64]

FEWEST_FRAMES = 10
"""Below this nothing is a take."""


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """What the cameras saw, frame by frame."""

    name: str
    """For messages and reports: the file's name."""
    layout: MarkerLayout
    times: Array
    """(T,) [s], increasing."""
    world: Array
    """(T, M, 3) [m]; NaN is a marker that was not seen."""

    @property
    def rate_hz(self) -> float:
        """Frames a second, by the median of the steps."""
        return float(1.0 / np.median(np.diff(self.times)))

    @property
    def seconds(self) -> float:
        """From the first frame to the last [s]."""
        return float(self.times[-1] - self.times[0])

    def frames_in(self, seconds: float) -> int:
        """How many frames pass in that time; at least one."""
        return max(round(seconds * self.rate_hz), 1)

    def part(self, start_s: float, end_s: float) -> Recording:
        """The frames from `start_s` to `end_s`, counted from the first frame; InputError where there are hardly any."""
        since = self.times - self.times[0]
        inside = (since >= start_s) & (since <= end_s)
        return recording_of(self.name, self.layout, self.times[inside], self.world[inside])


def recording_of(name: str, layout: MarkerLayout, times: Array, world: Array) -> Recording:
    """A recording of frames at `times` (T,); InputError where there are fewer than `FEWEST_FRAMES`."""
    if len(times) < FEWEST_FRAMES:
        raise InputError(f"{name} is too short to calibrate with: it has {len(times)} frames of a face.")
    return Recording(name, layout, times, world)


def gather(name: str, frames: Iterable[MarkerFrame], layout: Layout | None) -> Recording:
    """All `frames` under the names of `layout`, or of the one whose names fit best.

    InputError where no name is known, and where there are too few frames. Frames out of their order in time are left
    out.
    """
    labeller: Labeller | None = None
    times: list[float] = []
    positions: list[Array] = []
    for frame in frames:
        if labeller is None:
            labeller = Labeller(layout or detect_layout(frame.layout.names))
        if not times or frame.time_s > times[-1]:
            times.append(frame.time_s)
            positions.append(labeller(frame).positions)
    if labeller is None:
        raise InputError(f"{name} is too short to calibrate with: it has no frames.")
    return recording_of(name, labeller.layout.markers, np.array(times), np.array(positions))


def read_recording(where: str, layout: Layout | None, on_frame: Callable[[], None] = lambda: None) -> Recording:
    """The take at `where`, any file that `retarget run` takes; InputError as `gather`, and for a live stream."""
    source = open_source(where)
    if source.live:
        raise InputError(f"{where} is a live stream: calibrate from it with --from {where}, or record a take first.")

    def counted() -> Iterable[MarkerFrame]:
        for frame in source:
            on_frame()
            yield frame

    with source:
        return gather(Path(where).name, counted(), layout)
