"""When to ask for the model definitions, and whether those that came say anything new."""

from __future__ import annotations

import math

from retarget.udp.natnet.retry import Retry

_DOUBT_S = 5.0


class DefinitionsWatch:
    """Times are told, local monotonic [s]."""

    def __init__(self) -> None:
        self._retry = Retry(0.4, 5, 2.0)
        self._wanted = False
        self._octets: bytes | None = None
        self._came_s = -math.inf

    @property
    def known(self) -> bool:
        """Whether definitions came and nothing speaks against them."""
        return self._octets is not None and not self._wanted

    @property
    def next_s(self) -> float:
        """When to ask again."""
        return self._retry.next_s if self._wanted else math.inf

    def want(self) -> None:
        """Ask at once, and until they come."""
        if not self._wanted:
            self._wanted = True
            self._retry.reset()

    def doubt(self, now_s: float) -> None:
        """A frame does not agree with them: ask, but not again and again for the same disagreement."""
        if now_s - self._came_s > _DOUBT_S:
            self.want()

    def forget(self) -> None:
        """Another server: those that come next are new."""
        self._octets = None
        self.want()

    def due(self, now_s: float) -> bool:
        """Whether to ask now."""
        return self._wanted and self._retry.due(now_s)

    def came(self, octets: bytes, now_s: float) -> bool:
        """Take note of definitions; False when they are the same as before."""
        self._wanted = False
        self._came_s = now_s
        changed = octets != self._octets
        self._octets = octets
        return changed
