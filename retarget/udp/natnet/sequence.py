"""What a stream's frame numbers tell: which frames were lost, which came twice, which came too late to be used."""

from __future__ import annotations

from enum import Enum

_WINDOW = 64
_LARGEST_GAP = 10_000


class Arrival(Enum):
    """How a frame stands to those before it."""

    NEXT = "next"
    """Newer than all before; it is to be used."""
    DOUBLED = "doubled"
    """The same frame again."""
    LATE = "late"
    """Overtaken by newer ones."""
    RESTARTED = "restarted"
    """The numbers went far back or far ahead: the sender was restarted, rewound or looped; it is to be used."""


class FrameSequence:
    """Judges frame numbers as they come, remembering the last 64."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._seen = 0  # bit i: number `_last - i` arrived
        self.lost = 0
        """Numbers passed over and not come since."""

    def judge(self, number: int) -> Arrival:
        """Tell how frame `number` stands, and count what it shows to be lost."""
        if self._last is None:
            self._begin(number)
            return Arrival.NEXT
        step = number - self._last
        if step > _LARGEST_GAP or step <= -_WINDOW:
            self._begin(number)
            return Arrival.RESTARTED
        if step > 0:
            self.lost += step - 1
            self._last = number
            self._seen = (self._seen << step | 1) & ((1 << _WINDOW) - 1)
            return Arrival.NEXT
        return self._judge_recent(-step)

    def restart(self) -> None:
        """Expect any number next."""
        self._last = None

    def _begin(self, number: int) -> None:
        self._last = number
        self._seen = (1 << _WINDOW) - 1  # what came before the beginning was never ours to lose

    def _judge_recent(self, back: int) -> Arrival:
        if self._seen >> back & 1:
            return Arrival.DOUBLED
        self._seen |= 1 << back
        self.lost -= 1
        return Arrival.LATE
