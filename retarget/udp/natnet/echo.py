"""Reading the server's clock over the connection: echo requests out, answers in."""

from __future__ import annotations

from retarget.udp.natnet.clock import EchoClock
from retarget.udp.natnet.messages import EchoRequest, EchoResponse
from retarget.udp.natnet.retry import Retry

_QUICK_S, _QUICK_TIMES, _SLOW_S = 0.03, 10, 1.0
_MOST_OPEN = 64
_PATIENCE_S = 0.5


class Echoes:
    """Asks ten times quickly, then every second. Times are told, local monotonic [s]."""

    def __init__(self) -> None:
        self._retry = Retry(_QUICK_S, _QUICK_TIMES, _SLOW_S)
        self._open: dict[int, float] = {}
        self._until_s = 0.0
        self.clock: EchoClock | None = None
        """None where the server has no high-resolution clock."""

    @property
    def next_s(self) -> float:
        """When to ask again."""
        return self._retry.next_s if self.clock is not None else float("inf")

    def begin(self, ticks_per_s: int, now_s: float) -> None:
        """Read another clock; 0 ticks a second is none."""
        self.clock = EchoClock(ticks_per_s) if ticks_per_s > 0 else None
        self._open.clear()
        self._retry.reset()
        self._until_s = now_s + _PATIENCE_S

    def settled(self, now_s: float) -> bool:
        """Whether the clock is read, or need not be waited for."""
        return self.clock is None or self.clock.synchronised or now_s > self._until_s

    def due(self, now_s: float) -> EchoRequest | None:
        """The request that is to be sent now; it carries the time of asking in nanoseconds."""
        if self.clock is None or not self._retry.due(now_s):
            return None
        return EchoRequest(int(now_s * 1e9))

    def sent(self, request: EchoRequest, sent_s: float) -> None:
        """A request left."""
        if len(self._open) >= _MOST_OPEN:
            self._open.pop(next(iter(self._open)))
        self._open[request.client_stamp] = sent_s

    def answered(self, response: EchoResponse, received_s: float) -> None:
        """An answer came; one that was not asked for is ignored."""
        sent_s = self._open.pop(response.client_stamp, None)
        if sent_s is not None and self.clock is not None:
            self.clock.add(sent_s, received_s, response.server_ticks)
