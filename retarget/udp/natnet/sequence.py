"""What a stream's frame numbers tell: which frames were lost, which came twice, which came too late to be used.

Numbers alone do not tell a frame that comes again from a take that is played again, a short one in a loop above all.
The sender's clock does, from 3.0; without it, three frames in a row that are not new are taken to be another beginning,
and many in a row in any case, as clocks start over too.
"""

from __future__ import annotations

from enum import Enum

_WINDOW = 64
_LARGEST_GAP = 10_000
_OLD_IN_A_ROW, _OLD_BY_THE_CLOCK = 3, 10


class Arrival(Enum):
    """How a frame stands to those before it."""

    NEXT = "next"
    """Newer than all before; it is to be used."""
    DOUBLED = "doubled"
    """The same frame again."""
    LATE = "late"
    """Overtaken by newer ones."""
    RESTARTED = "restarted"
    """The numbers went back or far ahead: the sender was restarted, rewound or looped; the frame is to be used."""


class FrameSequence:
    """Judges frame numbers as they come, remembering the last 64."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._last_stamp = 0
        self._seen = 0  # bit i: number `_last - i` arrived
        self._old_in_a_row = 0
        self.lost = 0
        """Numbers passed over and not come since."""

    def judge(self, number: int, stamp: int = 0) -> Arrival:
        """Tell how frame `number` stands, and count what it shows to be lost.

        `stamp` is when it left, by the sender's clock in any unit; 0 where it has none.
        """
        arrival = self._judge(number, stamp)
        if arrival in {Arrival.NEXT, Arrival.RESTARTED}:
            self._last_stamp = stamp
            self._old_in_a_row = 0
        return arrival

    def restart(self) -> None:
        """Expect any number next."""
        self._last = None

    def _judge(self, number: int, stamp: int) -> Arrival:
        if self._last is None:
            self._begin(number)
            return Arrival.NEXT
        step = number - self._last
        if step > _LARGEST_GAP or step <= -_WINDOW or (step <= 0 and self._began_again(stamp)):
            self._begin(number)
            return Arrival.RESTARTED
        if step > 0:
            self.lost += step - 1
            self._last = number
            self._seen = (self._seen << step | 1) & ((1 << _WINDOW) - 1)
            return Arrival.NEXT
        return self._judge_recent(-step)

    def _began_again(self, stamp: int) -> bool:
        self._old_in_a_row += 1
        if stamp and self._last_stamp:
            return stamp > self._last_stamp or self._old_in_a_row >= _OLD_BY_THE_CLOCK
        return self._old_in_a_row >= _OLD_IN_A_ROW

    def _begin(self, number: int) -> None:
        self._last = number
        self._seen = (1 << _WINDOW) - 1  # what came before the beginning was never ours to lose

    def _judge_recent(self, back: int) -> Arrival:
        if self._seen >> back & 1:
            return Arrival.DOUBLED
        self._seen |= 1 << back
        self.lost -= 1
        return Arrival.LATE
