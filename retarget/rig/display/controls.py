"""What keys and mouse mean to the window: pure state, so that it is the same under every window system."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from retarget.rig.display.view import View

HELP = """h: this help
r: camera back to its place
space: freeze, and go on
s: save the picture
q, escape: quit
drag: walk round the face
wheel: come nearer"""

RADIANS_PER_PIXEL = 0.008
STEEPEST_RAD = math.radians(85)
ZOOM_PER_NOTCH = 1.1


class Controls:
    """Where the user has put the camera, and what he has asked for."""

    def __init__(self, view: View) -> None:
        self._home = view
        self.view = view
        self.frozen = False
        self.shows_help = False
        self.quit_asked = False
        self.picture_asked = False

    def press(self, key: str) -> None:
        """Take a key by its name, such as "r", "space" or "escape"; keys without a meaning change nothing."""
        if key in ("q", "escape"):
            self.quit_asked = True
        elif key == "h":
            self.shows_help = not self.shows_help
        elif key == "space":
            self.frozen = not self.frozen
        elif key == "s":
            self.picture_asked = True
        elif key == "r":
            self.view = replace(self._home, width=self.view.width, height=self.view.height)

    def drag(self, right: float, up: float) -> None:
        """Walk round the face; the mouse went `right` and `up` [pixel] and takes the face along."""
        pitch = self.view.pitch_rad - up * RADIANS_PER_PIXEL
        self.view = replace(
            self.view,
            yaw_rad=math.remainder(self.view.yaw_rad - right * RADIANS_PER_PIXEL, math.tau),
            pitch_rad=min(max(pitch, -STEEPEST_RAD), STEEPEST_RAD),
        )

    def turn_wheel(self, notches: float) -> None:
        """Come nearer for notches above zero."""
        zoom = self.view.zoom * ZOOM_PER_NOTCH**notches
        self.view = replace(self.view, zoom=min(max(zoom, 0.25), 10.0))

    def resize(self, width: int, height: int) -> None:
        """The window's inner size changed [pixel]."""
        largest = 4096 // self.view.supersampling
        self.view = replace(self.view, width=min(max(width, 16), largest), height=min(max(height, 16), largest))
