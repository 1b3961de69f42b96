"""When to ask again over a network that may lose both question and answer."""

from __future__ import annotations

import math


class Retry:
    """Quickly for the first `quick_times`, then slowly. No clock of its own: times are told [s]."""

    def __init__(self, quick_s: float, quick_times: int, slow_s: float) -> None:
        self._quick_s, self._quick_times, self._slow_s = quick_s, quick_times, slow_s
        self._times = 0
        self.next_s = -math.inf
        """When it is time again; at once, as long as it was never."""

    def due(self, now_s: float) -> bool:
        """Whether it is time; if so, the next time is put off."""
        if now_s < self.next_s:
            return False
        self._times += 1
        self.next_s = now_s + (self._quick_s if self._times < self._quick_times else self._slow_s)
        return True

    def reset(self) -> None:
        """Start over, quickly and at once."""
        self._times = 0
        self.next_s = -math.inf
