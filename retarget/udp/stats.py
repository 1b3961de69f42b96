"""What became of a stream's datagrams, in numbers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class StreamStats:
    """Counts since the stream was opened; a frame is in at most one of them."""

    received: int = 0
    """Frames handed on."""
    lost: int = 0
    """Frame numbers that never came."""
    doubled: int = 0
    """Frames that came again."""
    late: int = 0
    """Frames overtaken by newer ones, not handed on."""
    malformed: int = 0
    """Datagrams of the server that do not follow the protocol."""
    foreign: int = 0
    """Datagrams from somebody else."""
    dropped: int = 0
    """Frames that arrived and were thrown away because the reader lagged behind."""
    overflowed: int = 0
    """Datagrams that the kernel threw away because nobody took them (also in `lost`)."""
    reconnects: int = 0
    """Times that the server was silent, or changed, and was connected again."""
