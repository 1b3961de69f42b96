"""Runs a window on the screen it finds and does with it what a user would; writes what is to be seen into a folder.

The head turns to and fro, pose by pose, until the user presses escape. Reports one line of JSON.
"""

from __future__ import annotations

import itertools
import json
import os
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import ImageGrab

from retarget.rig.display.view import View
from retarget.rig.display.window import Window
from tests.rig.display.heads import head_pose, head_rig

if TYPE_CHECKING:
    from collections.abc import Callable

RIG = head_rig()
PATIENCE_S = 20.0


class User(threading.Thread):
    """Looks at the screen and presses keys, as the window system would report them."""

    def __init__(self, window: Window, folder: Path) -> None:
        super().__init__(daemon=True)
        self._window, self._folder = window, folder
        self.seen: dict[str, Any] = {}

    def run(self) -> None:
        """See the face, then the help, a frozen face, a saved picture and a larger window; then quit, or just close."""
        try:
            self.seen["face"] = self._wait(lambda screen: (screen == (0, 255, 0)).all(axis=-1).sum() > 20_000)
            self._grab().save(self._folder / "face.png")
            self.seen["moves"] = self._changes()
            self._press("h")
            self.seen["help"] = self._wait(lambda screen: (screen == 255).all(axis=-1).sum() > 100)
            self._grab().save(self._folder / "help.png")
            self._press("h")
            self._press("space")
            self.seen["gone"] = self._wait(lambda screen: (screen == 255).all(axis=-1).sum() < 5000)
            time.sleep(0.3)
            self.seen["freezes"] = not self._changes()
            self._press("s")
            self.seen["saved"] = self._until(lambda: any(self._folder.glob("ball head-*.png")))
            self._system_window().set_size(500, 300)
            self.seen["larger"] = self._wait(lambda screen: (screen == (0, 255, 0)).all(axis=-1).sum() > 60_000)
        finally:
            self._press("escape")

    def _system_window(self) -> Any:
        glass = self._window._glass
        assert glass is not None
        return glass._window

    def _press(self, name: str) -> None:
        from pyglet.window import key

        self._system_window().dispatch_event("on_key_press", getattr(key, name.upper()), 0)

    def _grab(self) -> Any:
        return ImageGrab.grab(xdisplay=os.environ["DISPLAY"])

    def _changes(self) -> bool:
        """Whether two of twenty looks at the screen differ."""
        looks = []
        for _ in range(20):
            looks.append(np.asarray(self._grab()))
            time.sleep(0.005)
        return any((a != b).any() for a, b in itertools.pairwise(looks))

    def _wait(self, condition: Callable[[np.ndarray], bool]) -> bool:
        return self._until(lambda: bool(condition(np.asarray(self._grab()))))

    def _until(self, condition: Callable[[], bool]) -> bool:
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            if time.monotonic() > end_s:
                return False
            time.sleep(0.02)
        return True


def main(folder: Path) -> None:
    over = threading.Event()
    with Window(RIG, View(320, 240), pictures=folder) as window:

        def feed() -> None:
            for number in itertools.count(1):
                if over.wait(0.01):
                    return
                window(head_pose(RIG, yaw_rad=0.3 * (number % 2), number=number))

        feeder, user = threading.Thread(target=feed, daemon=True), User(window, folder)
        feeder.start()
        user.start()
        window.run()
        over.set()
        user.join()
        feeder.join()
    closing_s = _seconds_to_close_from_another_thread()
    print(json.dumps(user.seen | {"closing_s": closing_s}))


def _seconds_to_close_from_another_thread() -> float:
    with Window(RIG, View(64, 64)) as window:
        threading.Timer(0.3, window.close).start()
        start_s = time.monotonic()
        window.run()
        return time.monotonic() - start_s


if __name__ == "__main__":
    main(Path(sys.argv[1]))
