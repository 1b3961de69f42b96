"""Which poses become pictures: a film has a fixed rate, a marker stream has its own and may lose frames."""

from __future__ import annotations

import math

FASTEST_HZ = 60.0
"""Pictures a second beyond which no eye sees more."""
# How early a pose may come and still be the picture that is due, so that jitter neither skips nor doubles one; less
# than the 4.2 ms between two poses at 240 Hz.
_EARLY_S = 0.0035
_LONGEST_FREEZE_S = 2.0


def picture_rate_hz(stream_hz: float | None) -> float:
    """The stream's own rate where it is at most 60 Hz, else its largest whole fraction below; 60 if unknown [Hz]."""
    if stream_hz is None or not math.isfinite(stream_hz) or stream_hz <= 0:
        return FASTEST_HZ
    return stream_hz / math.ceil(stream_hz / FASTEST_HZ - 1e-6)


class PictureClock:
    """Says how many pictures are due: none between two pictures, more than one after a gap in the stream.

    A gap longer than two seconds counts as two, so that a stream that rests for an hour does not fill the disk.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._start_s = math.nan
        self._next = 0

    def due(self, time_s: float) -> int:
        """Pictures to draw for the pose of `time_s` [s], on the stream's own clock; a clock set back starts anew."""
        if math.isnan(self._start_s) or time_s < self._start_s:
            self._start_s, self._next = time_s, 0
        due = max(0, math.floor((time_s - self._start_s + _EARLY_S) * self._rate_hz) + 1 - self._next)
        self._next += due
        return min(due, max(1, round(_LONGEST_FREEZE_S * self._rate_hz)))
