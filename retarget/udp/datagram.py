"""A datagram as it came or went, with what the wire does not say: when, which way, on which channel, with whom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Datagram:
    """One UDP payload; what a take keeps, so that a better decoder can read it again."""

    received_s: float
    """Local monotonic time of arrival or departure [s]."""
    direction: Literal["in", "out"]
    """"in" from the peer, "out" to it."""
    channel: Literal["command", "data"]
    peer: tuple[str, int]
    """The other end's address and port."""
    payload: bytes
