"""One line of a benchmark, and how to time what it tells."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass(frozen=True, slots=True)
class Row:
    """What was measured, ours and a peer's, and what we aim for."""

    what: str
    value: float
    unit: str
    peer: str = ""
    peer_value: float | None = None
    aim: str = ""

    @property
    def ratio(self) -> float | None:
        """Ours over the peer's, in the row's unit."""
        return self.value / self.peer_value if self.peer_value else None


def seconds_per_call(call: Callable[[], object], repeat: int = 200, warm_up: int = 5) -> float:
    """Median duration of `call` [s]."""
    for _ in range(warm_up):
        call()
    durations = np.empty(repeat)
    for i in range(repeat):
        start = time.perf_counter()
        call()
        durations[i] = time.perf_counter() - start
    return float(np.median(durations))
