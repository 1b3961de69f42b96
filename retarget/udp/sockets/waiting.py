"""Waiting for several sockets at once."""

from __future__ import annotations

import math
import select
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence


class HasDescriptor(Protocol):
    """A socket of whatever kind."""

    def fileno(self) -> int:
        """Its descriptor; -1 once closed."""


def wait_readable(sockets: Sequence[HasDescriptor | int], timeout_s: float) -> list[int]:
    """Descriptors of those that hold something, at the latest after `timeout_s` [s] (rounded up to milliseconds)."""
    waiting = select.poll()
    for each in sockets:
        descriptor = each if isinstance(each, int) else each.fileno()
        if descriptor >= 0:
            waiting.register(descriptor, select.POLLIN)
    return [descriptor for descriptor, _ in waiting.poll(math.ceil(1e3 * max(0.0, timeout_s)))]
