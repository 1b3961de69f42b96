"""pyrender's renderer with a frame buffer of our own choice. Imported late: it needs pyrender on EGL (`platform`).

pyrender 0.1.45 always draws with four samples a pixel and reads the depth back as well; without a graphics card each
costs more than the picture itself. This one takes the number of samples as it is told and reads colour only.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pyrender
from OpenGL import GL


class Renderer(pyrender.Renderer):  # type: ignore[misc]  # pyrender is untyped
    """Draws into a buffer of `samples` samples a pixel (0: the pixel's own) and reads it back as OpenGL holds it.

    That is (H, W, 4) uint8, lower row first: any other form takes four times as long to read.
    """

    def __init__(self, width: int, height: int, samples: int) -> None:
        super().__init__(width, height)
        self._samples = samples
        self._main_fb: int | None = None
        self._main_fb_dims: tuple[int, int] = (0, 0)

    def upload(self, scene: Any) -> None:
        """Send every mesh and texture of the scene to the context, once."""
        self._update_context(scene, pyrender.RenderFlags.NONE)

    def _configure_main_framebuffer(self) -> None:
        size = (self.viewport_width, self.viewport_height)
        if self._main_fb is not None and self._main_fb_dims == size:
            return
        self._delete_main_framebuffer()
        self._main_fb_ms, self._main_cb_ms, self._main_db_ms = _framebuffer(size, self._samples)
        self._main_fb, self._main_cb, self._main_db = _framebuffer(size, 0) if self._samples else (0, 0, 0)
        self._main_fb_dims = size

    def _read_main_framebuffer(self, scene: Any, flags: int) -> np.ndarray[Any, np.dtype[np.uint8]]:  # noqa: ARG002 - pyrender's signature
        width, height = self._main_fb_dims
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._main_fb_ms)
        if self._samples:
            GL.glBindFramebuffer(GL.GL_DRAW_FRAMEBUFFER, self._main_fb)
            GL.glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL.GL_COLOR_BUFFER_BIT, GL.GL_NEAREST)
            GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._main_fb)
        pixels = np.empty((height, width, 4), np.uint8)
        GL.glReadPixels(0, 0, width, height, GL.GL_RGBA, GL.GL_UNSIGNED_BYTE, pixels)
        return pixels

    def _bind_and_draw_primitive(self, primitive: Any, pose: Any, program: Any, flags: int) -> None:
        # What can be looked through must not hide what is drawn behind it later.
        GL.glDepthMask(GL.GL_FALSE if primitive.material.alphaMode == "BLEND" else GL.GL_TRUE)
        super()._bind_and_draw_primitive(primitive, pose, program, flags)
        GL.glDepthMask(GL.GL_TRUE)


def _framebuffer(size: tuple[int, int], samples: int) -> tuple[int, int, int]:
    """(frame buffer, colour, depth) of new storage."""
    color, depth = (int(name) for name in GL.glGenRenderbuffers(2))
    for name, form in ((color, GL.GL_RGBA8), (depth, GL.GL_DEPTH_COMPONENT24)):
        GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, name)
        GL.glRenderbufferStorageMultisample(GL.GL_RENDERBUFFER, samples, form, *size)
    buffer = int(GL.glGenFramebuffers(1))
    GL.glBindFramebuffer(GL.GL_DRAW_FRAMEBUFFER, buffer)
    for point, name in ((GL.GL_COLOR_ATTACHMENT0, color), (GL.GL_DEPTH_ATTACHMENT, depth)):
        GL.glFramebufferRenderbuffer(GL.GL_DRAW_FRAMEBUFFER, point, GL.GL_RENDERBUFFER, name)
    return buffer, color, depth
