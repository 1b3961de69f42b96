"""When the next frame is due.

Due times follow from one another, not from when a frame was really sent, so that a late frame does not delay all that
follow; only when the server fell far behind, it starts anew from there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from retarget.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_LONGEST_PAUSE_S = 10.0
_FAR_BEHIND_S = 0.25


@dataclass(frozen=True, slots=True)
class OriginalPace:
    """As the take was recorded, jitter and gaps included; a gap longer than 10 s lasts 10 s."""

    def interval_s(self, times_s: NDArray[np.float64], rate_hz: float, index: int, following: int) -> float:
        """Time from frame `index` to frame `following` [s]."""
        if following != index + 1:
            return 1.0 / rate_hz
        return float(min(max(times_s[following] - times_s[index], 0.0), _LONGEST_PAUSE_S))


@dataclass(frozen=True, slots=True)
class SteadyPace:
    """A fixed number of frames per second."""

    rate_hz: float

    def __post_init__(self) -> None:
        if not 0.0 < self.rate_hz < 1e5:
            raise InputError(f"A rate of {self.rate_hz} frames per second cannot be served; give one such as 120.")

    def interval_s(self, times_s: NDArray[np.float64], rate_hz: float, index: int, following: int) -> float:
        """Time from frame `index` to frame `following` [s]."""
        del times_s, rate_hz, index, following
        return 1.0 / self.rate_hz


@dataclass(frozen=True, slots=True)
class FastestPace:
    """As fast as this machine can; most clients lose frames."""

    def interval_s(self, times_s: NDArray[np.float64], rate_hz: float, index: int, following: int) -> float:
        """Time from frame `index` to frame `following` [s]."""
        del times_s, rate_hz, index, following
        return 0.0


Pace = OriginalPace | SteadyPace | FastestPace


class Schedule:
    """Keeps the due time of the next frame. Times are told, local monotonic [s]."""

    def __init__(self, start_s: float) -> None:
        self.due_s = start_s

    def advance(self, interval_s: float, now_s: float) -> None:
        """The frame that was due is sent; the next is due `interval_s` after it was."""
        self.due_s += interval_s
        if now_s - self.due_s > _FAR_BEHIND_S:
            self.due_s = now_s

    def restart(self, now_s: float) -> None:
        """After a pause or a jump: due now."""
        self.due_s = now_s
