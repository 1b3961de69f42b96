"""Where a reel stands: play, pause, jump, range, loop and speed. No clock and no thread of its own."""

from __future__ import annotations

from enum import Enum

from retarget.errors import InputError

MIN_SPEED, MAX_SPEED = 0.01, 100.0


class AtEnd(Enum):
    """What follows the last frame."""

    STOP = "stop"
    LOOP = "loop"


class Playback:
    """A position within `length` frames, played from `first` to `last`; all counted from 0."""

    def __init__(self, length: int, speed: float = 1.0, at_end: AtEnd = AtEnd.STOP) -> None:
        self.length = length
        self.first, self.last = 0, length - 1
        self.index = 0
        """The frame that is next; `last` + 1 when there is none."""
        self.playing = True
        self.at_end = at_end
        self._speed = _checked(speed)

    @property
    def speed(self) -> float:
        """Seconds of the take per second."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        self._speed = _checked(speed)

    @property
    def finished(self) -> bool:
        """Whether the last frame was played and nothing follows."""
        return self.index > self.last

    @property
    def following(self) -> int | None:
        """The frame after the next; None at the end."""
        if self.index < self.last:
            return self.index + 1
        return self.first if self.at_end is AtEnd.LOOP else None

    def advance(self) -> None:
        """The next frame was played."""
        following = self.following
        self.index = self.last + 1 if following is None else following

    def play(self) -> None:
        """Go on; from the beginning when the end was reached."""
        self.playing = True
        if self.finished:
            self.index = self.first

    def pause(self) -> None:
        """Stay where it is."""
        self.playing = False

    def jump(self, index: int) -> None:
        """Go to a frame within the range; one outside goes to its nearer end."""
        self.index = min(max(index, self.first), self.last)

    def begin_at(self, index: int) -> None:
        """Set the first frame of the range."""
        self.first = min(max(index, 0), self.last)
        self.jump(self.index)

    def end_at(self, index: int) -> None:
        """Set the last frame of the range."""
        self.last = max(min(index, self.length - 1), self.first)
        self.jump(self.index)


def _checked(speed: float) -> float:
    if not MIN_SPEED <= speed <= MAX_SPEED:
        raise InputError(f"A speed of {speed} cannot be played; give one from {MIN_SPEED} to {MAX_SPEED}, such as 1.")
    return speed
