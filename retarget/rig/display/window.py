"""The sink `window`: the newest pose, live, on the screen.

Three parties: any thread hands over poses, the `painter` turns the newest one into a picture, and the main thread,
which window systems insist on, shows pictures and listens to keys and mouse (`glass`, `controls`). Nothing waits for
anything slower than itself; poses that the drawing cannot follow are left out.
"""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Self

from retarget.errors import DisplayError, OutputError
from retarget.rig.display.controls import HELP, Controls
from retarget.rig.display.glass import Glass
from retarget.rig.display.overlay import with_text
from retarget.rig.display.painter import Painter
from retarget.rig.display.pictures import save_picture
from retarget.rig.display.view import View
from retarget.rig.posing import rest_pose

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from retarget.frames import Pose
    from retarget.rig.display.painter import Painted
    from retarget.rig.model import Rig
    from retarget.rig.skinning import Deformed

PATIENCE_S = 0.01
"""How long keys and mouse wait for a picture that does not come."""
NOTICE_S = 2.0
"""How long the window says what it has just done."""


class Window:
    """Open it and `run` it in the main thread; hand it poses, and `close` it, from any.

    The face stands at rest until the first pose comes.
    """

    def __init__(
        self,
        rig: Rig,
        view: View | None = None,
        skin: Callable[[Pose], Deformed] | None = None,
        pictures: Path | None = None,
    ) -> None:
        """`view` and `skin` as for `Offscreen`; the key s saves into `pictures`, or else into the current folder."""
        self._rig = rig
        self._controls = Controls(view or View())
        self._lock = threading.Lock()
        self._newest = self._followed = rest_pose(rig)
        self._painter = Painter(rig, self._controls.view, self._newest, skin)
        self._pictures = pictures or Path()
        self._glass: Glass | None = None
        self._painted: Painted | None = None
        self._words = ""
        self._rate = _Rate()
        self._notice, self._notice_until_s = "", 0.0
        self._closing = False

    def __enter__(self) -> Self:
        self._painter.__enter__()
        try:
            view = self._controls.view
            self._glass = Glass(view.width, view.height, self._rig.name, self._controls)
        except DisplayError:
            self._painter.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing = True
        self._painter.__exit__(kind, error, trace)
        if self._glass:
            self._glass.close()
            self._glass = None

    def __call__(self, pose: Pose) -> None:
        """Show this pose as soon as may be; returns at once."""
        with self._lock:
            self._newest = pose
            self._follow()

    def close(self) -> None:
        """Ask `run` to return, from any thread."""
        self._closing = True

    def run(self) -> None:
        """Show pictures until the user quits or someone calls `close`; DisplayError where the drawing stopped."""
        while not (self._closing or self._controls.quit_asked):
            self._turn()

    def _turn(self) -> None:
        """One round of the main thread: what the user did, a picture if there is a new one, and the window's bar."""
        if self._glass is None:
            raise DisplayError("The window cannot run: it was not opened by `with`.")
        self._glass.take_events()
        with self._lock:
            self._follow()
        painted = self._painter.next_picture(PATIENCE_S)
        self._painted = painted or self._painted
        if painted and (rate_hz := self._rate.count(time.monotonic())):
            self._glass.set_title(f"{self._rig.name} - {rate_hz:.0f} pictures a second")
        if self._controls.picture_asked and self._painted:
            self._save(self._painted)
        self._refresh(self._glass, is_new=painted is not None)

    def _follow(self) -> None:
        """Have the newest pose drawn, as the user wants to see it; a frozen face stays, but he may walk round it."""
        if not self._controls.frozen:
            self._followed = self._newest
        self._painter.want(self._followed, self._controls.view)

    def _save(self, painted: Painted) -> None:
        self._controls.picture_asked = False
        path = self._pictures / f"{self._rig.name}-{painted.pose.number:06d}.png"
        try:
            save_picture(path, painted.picture)
        except OutputError as error:
            self._notice = str(error)
        else:
            self._notice = f"Saved {path}"
        self._notice_until_s = time.monotonic() + NOTICE_S

    def _refresh(self, glass: Glass, *, is_new: bool) -> None:
        words = self._current_words()
        if self._painted and (is_new or glass.damaged or words != self._words):
            picture = self._painted.picture
            glass.show(with_text(picture, words) if words else picture)
            self._words = words

    def _current_words(self) -> str:
        notice = self._notice if time.monotonic() < self._notice_until_s else ""
        lines = [HELP if self._controls.shows_help else "", "frozen" if self._controls.frozen else "", notice]
        return "\n".join(line for line in lines if line)


class _Rate:
    """Counts pictures and tells, once a second, how many there were [Hz]."""

    def __init__(self) -> None:
        self._since_s = time.monotonic()
        self._count = 0

    def count(self, now_s: float) -> float | None:
        """One more picture; the rate where a second is over."""
        self._count += 1
        if now_s - self._since_s < 1.0:
            return None
        rate_hz = self._count / (now_s - self._since_s)
        self._since_s, self._count = now_s, 0
        return rate_hz
