"""A recorded marker take in memory, whatever file it came from.

Positions are metres, float64, ``world`` (the capture volume, +Y up where the file tells its up axis). Frames are
numbered from 0, the first in the file, so that a picture, a row of a table and a frame of the take share one number;
the number that the recording program gave to the first frame is kept beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from retarget.frames import MarkerFrame

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from retarget.frames import MarkerLayout


@dataclass(frozen=True, slots=True, eq=False)
class MarkerClip:
    """All frames of one take; iterating gives them as `MarkerFrame`s, with the file's own time from 0."""

    layout: MarkerLayout
    """The names of the file, as they stand there; nothing is known of the rig yet."""
    rate_hz: float
    positions: NDArray[np.float64]
    """(N, M, 3) [m], ``world``; NaN is a marker that was not seen."""
    source: Path
    first_frame: int = 1
    """What the file calls its first frame, which here has the number 0."""
    notes: tuple[str, ...] = ()
    """What the reader had to decide about this file, one sentence each."""

    @property
    def duration_s(self) -> float:
        """Length of the take [s]; every frame lasts one period."""
        return len(self) / self.rate_hz

    def __len__(self) -> int:
        return len(self.positions)

    def __iter__(self) -> Iterator[MarkerFrame]:
        return (self.frame(i) for i in range(len(self)))

    def frame(self, number: int) -> MarkerFrame:
        """The frame `number`, 0 to N - 1; IndexError beyond."""
        if not 0 <= number < len(self):
            raise IndexError(f"frame {number} of a take of {len(self)} frames")
        time_s = number / self.rate_hz
        return MarkerFrame(number, time_s, time_s, self.layout, self.positions[number])
