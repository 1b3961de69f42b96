"""A thread that turns the newest pose into a picture, as fast as it can and no faster than poses come.

Its OpenGL context never leaves it: where the window's own is current, in the main thread, no second one can be.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from retarget.errors import DisplayError, RetargetError
from retarget.rig.display.offscreen import Offscreen

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    import numpy as np
    from numpy.typing import NDArray

    from retarget.frames import Pose
    from retarget.rig.display.view import View
    from retarget.rig.model import Rig
    from retarget.rig.skinning import Deformed


@dataclass(frozen=True, slots=True, eq=False)
class Painted:
    """A picture and what it shows."""

    pose: Pose
    view: View
    picture: NDArray[np.uint8]
    """(H, W, 3), sRGB."""


class Painter:
    """A context manager; every method may be called from any thread.

    Poses and pictures that come too fast give way to newer ones.
    """

    def __init__(self, rig: Rig, view: View, pose: Pose, skin: Callable[[Pose], Deformed] | None = None) -> None:
        """`view` and `skin` as for `Offscreen`; `pose` is what the first picture shows."""
        self._offscreen = Offscreen(rig, view, skin)
        self._changed = threading.Condition()
        self._wanted = (pose, view)
        self._fresh: Painted | None = None
        self._opened = threading.Event()
        self._stopping = False
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._work, name="window painter", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        self._opened.wait()
        self._raise_error()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        self._thread.join()

    def want(self, pose: Pose, view: View) -> None:
        """Draw this next, unless it was the last that was asked for."""
        with self._changed:
            if pose is not self._wanted[0] or view is not self._wanted[1]:
                self._wanted = (pose, view)
                self._changed.notify_all()

    def next_picture(self, timeout_s: float) -> Painted | None:
        """The newest picture not yet taken, or None when none comes in time; raises what stopped the drawing."""
        with self._changed:
            self._changed.wait_for(lambda: self._fresh or self._error, timeout_s)
            self._raise_error()
            painted, self._fresh = self._fresh, None
            return painted

    def _work(self) -> None:
        try:
            with self._offscreen:
                self._opened.set()
                self._paint()
        except Exception as error:  # whatever it was, the thread that shows the pictures must hear of it
            with self._changed:
                self._error = error
                self._changed.notify_all()
        finally:
            self._opened.set()

    def _paint(self) -> None:
        done = None
        while (wanted := self._next_wanted(done)) is not None:
            pose, view = done = wanted
            if view is not self._offscreen.view:
                self._offscreen.view = view
            painted = Painted(pose, view, self._offscreen.render(pose))
            with self._changed:
                self._fresh = painted
                self._changed.notify_all()

    def _next_wanted(self, done: tuple[Pose, View] | None) -> tuple[Pose, View] | None:
        with self._changed:
            self._changed.wait_for(lambda: self._stopping or self._wanted is not done)
            return None if self._stopping else self._wanted

    def _raise_error(self) -> None:
        if isinstance(self._error, RetargetError):
            raise self._error
        if self._error:
            raise DisplayError(f"Drawing stopped: {self._error!r}.") from self._error
