"""Every sink behind a queue of its own, so that a slow one never stalls the others, the solver or the receiver.

Two policies for a full queue: `Backlog.WAIT` holds the source back, which a file allows; `Backlog.DROP_OLDEST` keeps
the newest poses and counts what it drops, which a live stream needs.
"""

from __future__ import annotations

import threading
from collections import deque
from enum import Enum, auto
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from retarget.errors import RetargetError

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

    from retarget.frames import MarkerFrame, Pose


class Sink(Protocol):
    """Takes poses, one after the other."""

    def __call__(self, pose: Pose) -> None:
        """Write, draw or send one pose."""


class FrameSink(Protocol):
    """Takes marker frames as the source gives them, one after the other."""

    def __call__(self, frame: MarkerFrame) -> None:
        """Send one frame."""


Item = TypeVar("Item")


class Backlog(Enum):
    """What happens to a pose that finds the queue full."""

    WAIT = auto()
    DROP_OLDEST = auto()


class Outlet(Generic[Item]):
    """One sink, opened, fed and closed in a thread of its own (a drawing context belongs to the thread that made it).

    `start` returns once the sink is open, or raises what opening raised. An error while writing closes this sink
    alone; it is kept in `error`, and later poses are ignored.
    """

    def __init__(
        self,
        name: str,
        opener: Callable[[], AbstractContextManager[Callable[[Item], None]]],
        backlog: Backlog,
        capacity: int,
    ) -> None:
        self.name = name
        self.written = 0
        self.dropped = 0
        self.error: RetargetError | None = None
        self._opener = opener
        self._backlog = backlog
        self._capacity = capacity
        self._items: deque[Item] = deque()
        self._changed = threading.Condition()
        self._settled = threading.Event()
        self._is_open = False
        self._closing = False
        self._thread = threading.Thread(target=self._work, name=f"sink {name}", daemon=True)

    def start(self) -> None:
        """Begin to open the sink."""
        self._thread.start()

    def wait_open(self) -> None:
        """Return once the sink is open; raise what opening raised."""
        self._settled.wait()
        self.check_opening()

    def check_opening(self) -> None:
        """Raise what opening raised, if it has failed by now."""
        if self.error and not self._is_open:
            raise self.error

    @property
    def waiting(self) -> int:
        """Poses in the queue."""
        return len(self._items)

    def put(self, item: Item) -> None:
        """Hand over one pose, or whatever this sink takes."""
        with self._changed:
            if self._backlog is Backlog.WAIT:
                self._changed.wait_for(lambda: len(self._items) < self._capacity or self.error or self._closing)
            elif len(self._items) >= self._capacity:
                self._items.popleft()
                self.dropped += 1
            if not (self.error or self._closing):
                self._items.append(item)
                self._changed.notify_all()

    def finish(self, *, timeout_s: float | None = None) -> bool:
        """Let the sink take what still waits, then close it; False if it has not come to its end after `timeout_s`."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def abandon(self) -> None:
        """Forget what still waits; `finish` then closes the sink with what it has."""
        with self._changed:
            self.dropped += len(self._items)
            self._items.clear()
            self._changed.notify_all()

    def _work(self) -> None:
        try:
            with self._opener() as sink:
                self._is_open = True
                self._settled.set()
                while (item := self._next()) is not None:
                    sink(item)
                    self.written += 1
        except RetargetError as error:
            self._fail(error)
        except Exception as error:
            self._fail(RetargetError(f"{self.name} stopped: {error!r}."))
            raise
        finally:
            self._settled.set()

    def _next(self) -> Item | None:
        with self._changed:
            self._changed.wait_for(lambda: self._items or self._closing)
            item = self._items.popleft() if self._items else None
            self._changed.notify_all()
            return item

    def _fail(self, error: RetargetError) -> None:
        with self._changed:
            self.error = error
            self._items.clear()
            self._changed.notify_all()
