"""How a running command is ended: Ctrl-C, SIGTERM, or a time limit."""

from __future__ import annotations

import signal
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@contextmanager
def stopped_by_signals(stop: Callable[[], None], hurry: Callable[[], None] | None = None) -> Iterator[None]:
    """The first Ctrl-C or SIGTERM calls `stop`, each later one `hurry` (or `stop` again)."""
    asked: list[int] = []

    def interrupt(number: int, frame: object) -> None:  # noqa: ARG001
        asked.append(number)
        (stop if len(asked) == 1 or hurry is None else hurry)()

    before = {number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, action in before.items():
            signal.signal(number, action)


@contextmanager
def stopped_after(seconds: float | None, stop: Callable[[], None]) -> Iterator[None]:
    """Call `stop` after so long [s]; never for None."""
    if seconds is None:
        yield
        return
    timer = threading.Timer(seconds, stop)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
