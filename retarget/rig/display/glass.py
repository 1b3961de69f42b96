"""A window on the screen that shows pictures and reports keys and mouse, by pyglet on X11.

Everything here belongs to one thread, the main one.
"""

from __future__ import annotations

import ctypes
import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget.errors import DisplayError
from retarget.rig.display.platform import PACKAGES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.rig.display.controls import Controls


class Glass:
    """Open while it exists; what the user does goes to `controls`."""

    def __init__(self, width: int, height: int, title: str, controls: Controls) -> None:
        """Open the window; DisplayError where there is no screen, or no OpenGL for it."""
        self._window = _open(width, height, title)
        self._gl = import_module("pyglet.gl")
        self._texture, self._framebuffer = self._make_source()
        self._shown: tuple[int, int] = (0, 0)
        self._controls = controls
        self.damaged = True
        """True where the picture must be shown again, though it is the same."""
        self._window.push_handlers(
            on_key_press=self._on_key_press,
            on_mouse_drag=self._on_mouse_drag,
            on_mouse_scroll=self._on_mouse_scroll,
            on_resize=self._on_resize,
            on_expose=self._on_expose,
            on_close=self._on_close,
        )
        controls.resize(*self._window.get_framebuffer_size())

    def take_events(self) -> None:
        """Report what the user has done since the last call."""
        self._window.switch_to()
        self._window.dispatch_events()

    def show(self, picture: NDArray[np.uint8]) -> None:
        """Put a picture (H, W, 3) up, stretched to the window."""
        gl, (height, width) = self._gl, picture.shape[:2]
        pixels = np.ascontiguousarray(picture)
        self._window.switch_to()
        gl.glBindTexture(gl.GL_TEXTURE_2D, self._texture)
        gl.glPixelStorei(gl.GL_UNPACK_ALIGNMENT, 1)
        data = pixels.ctypes.data_as(ctypes.POINTER(ctypes.c_ubyte))
        gl.glTexImage2D(gl.GL_TEXTURE_2D, 0, gl.GL_RGBA8, width, height, 0, gl.GL_RGB, gl.GL_UNSIGNED_BYTE, data)
        gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, self._framebuffer)
        gl.glFramebufferTexture2D(gl.GL_READ_FRAMEBUFFER, gl.GL_COLOR_ATTACHMENT0, gl.GL_TEXTURE_2D, self._texture, 0)
        gl.glBindFramebuffer(gl.GL_DRAW_FRAMEBUFFER, 0)
        to_width, to_height = self._window.get_framebuffer_size()
        # The picture's first row is its upper one, and OpenGL's the lower: the copy turns it over.
        gl.glBlitFramebuffer(0, 0, width, height, 0, to_height, to_width, 0, gl.GL_COLOR_BUFFER_BIT, gl.GL_LINEAR)
        self._window.flip()
        self.damaged = False

    def set_title(self, title: str) -> None:
        """Change what the window's bar says."""
        self._window.set_caption(title)

    def close(self) -> None:
        """Take the window off the screen."""
        self._window.close()

    def _make_source(self) -> tuple[int, int]:
        gl = self._gl
        texture, framebuffer = gl.GLuint(), gl.GLuint()
        gl.glGenTextures(1, ctypes.byref(texture))
        gl.glGenFramebuffers(1, ctypes.byref(framebuffer))
        return texture.value, framebuffer.value

    def _on_key_press(self, symbol: int, modifiers: int) -> bool:  # noqa: ARG002 - pyglet's signature, here and below
        self._controls.press(import_module("pyglet.window.key").symbol_string(symbol).lower())
        return True  # or pyglet would close the window at escape itself

    def _on_mouse_drag(self, x: int, y: int, dx: int, dy: int, buttons: int, modifiers: int) -> None:  # noqa: ARG002
        self._controls.drag(dx, dy)

    def _on_mouse_scroll(self, x: int, y: int, scroll_x: float, scroll_y: float) -> None:  # noqa: ARG002
        self._controls.turn_wheel(scroll_y)

    def _on_resize(self, width: int, height: int) -> None:  # noqa: ARG002 - points, where pixels count
        self._controls.resize(*self._window.get_framebuffer_size())
        self.damaged = True

    def _on_expose(self) -> None:
        self.damaged = True

    def _on_close(self) -> bool:
        self._controls.quit_asked = True
        return True


def _open(width: int, height: int, title: str) -> Any:
    if not os.environ.get("DISPLAY"):
        raise DisplayError(
            "There is no screen to open a window on (DISPLAY is not set); write a video or pictures instead: "
            "--to out.mp4 or --to frames/."
        )
    try:
        pyglet = import_module("pyglet")
        pyglet.options["shadow_window"] = False  # a second, hidden window that only shared resources would need
        window = import_module("pyglet.window")
        return window.Window(width, height, caption=title, resizable=True, vsync=False)
    except Exception as error:
        reason = str(error) or type(error).__name__
        raise DisplayError(
            f"No window can be opened on the screen {os.environ['DISPLAY']} ({reason}). On Debian or Ubuntu: {PACKAGES}"
        ) from error
