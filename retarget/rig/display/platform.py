"""Drawing without a display server: finds EGL and opens a context on it, or says in one sentence what is missing.

PyOpenGL binds itself to one platform, named by an environment variable, at its first import in a process. Here it is
always EGL: the window, too, only shows pictures that were drawn off the screen, so that a window and a video can be
made in one run.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from retarget.errors import DisplayError

if TYPE_CHECKING:
    from collections.abc import Iterable

PACKAGES = "apt-get install -y --no-install-recommends libegl1 libgl1 libgl1-mesa-dri"
"""What Debian and Ubuntu need, with or without a graphics card."""

SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "software rasterizer", "swr")


def load_pyrender() -> Any:
    """The module pyrender, bound to EGL; DisplayError where that cannot be."""
    bound = sys.modules.get("OpenGL.platform")
    if bound is None:
        os.environ["PYOPENGL_PLATFORM"] = "egl"
    elif type(bound.PLATFORM).__name__ != "EGLPlatform":
        raise DisplayError(
            "OpenGL was loaded in this process before retarget, and not for EGL; set PYOPENGL_PLATFORM=egl beforehand."
        )
    try:
        import_module("pyrender.platforms.egl")
        return import_module("pyrender")
    except (ImportError, OSError, AttributeError, RuntimeError) as error:
        raise DisplayError(
            f"No picture can be drawn: EGL is missing here ({error}). On Debian or Ubuntu: {PACKAGES}"
        ) from error


class Context:
    """An OpenGL context without a surface; any thread may use it in turn, between `acquire` and `release`."""

    def __init__(self) -> None:
        load_pyrender()
        self._egl = import_module("OpenGL.EGL")
        self._platform = _first_that_works(_devices())
        gl = import_module("OpenGL.GL")
        self.renderer = gl.glGetString(gl.GL_RENDERER).decode(errors="replace")
        """The driver's own name of what draws."""
        self._id = import_module("OpenGL.platform").GetCurrentContext()
        self.release()

    @property
    def is_software(self) -> bool:
        """True where the processor draws, not a graphics card."""
        return any(name in self.renderer.lower() for name in SOFTWARE_RENDERERS)

    def acquire(self) -> None:
        """Make the context current in the calling thread."""
        self._platform.make_current()

    def release(self) -> None:
        """Leave the thread without a context."""
        egl = self._egl
        egl.eglMakeCurrent(self._platform._egl_display, egl.EGL_NO_SURFACE, egl.EGL_NO_SURFACE, egl.EGL_NO_CONTEXT)

    def close(self) -> None:
        """Free the context. Its EGL display stays open, for it is shared by all contexts of the process."""
        self.release()
        self._egl.eglDestroyContext(self._platform._egl_display, self._platform._egl_context)
        self._platform._egl_context = self._platform._egl_display = None  # or its destructor would close the display
        import_module("OpenGL.contextdata").cleanupContext(self._id)


def _devices() -> Iterable[Any]:
    """The cards that EGL knows, the software renderer last; only the one that EGL_DEVICE_ID names where that is set."""
    egl = import_module("pyrender.platforms.egl")
    chosen = os.environ.get("EGL_DEVICE_ID")
    try:
        return [egl.get_device_by_index(int(chosen))] if chosen else egl.query_devices() or [egl.EGLDevice()]
    except RuntimeError:
        return [egl.EGLDevice()]
    except ValueError as error:
        raise DisplayError(f"EGL_DEVICE_ID is {chosen!r}, and EGL has no such device here; unset it.") from error


def _first_that_works(devices: Iterable[Any]) -> Any:
    platform_class = import_module("pyrender.platforms.egl").EGLPlatform
    reason: Exception | None = None
    for device in devices:
        platform = platform_class(1, 1, device=device)
        try:
            platform.init_context()
        except Exception as error:  # assertions and EGL errors of many kinds, all of one meaning
            reason = error
            platform._egl_display = platform._egl_context = None
        else:
            return platform
    raise DisplayError(
        f"No picture can be drawn: EGL opens no OpenGL 4.1 context here ({type(reason).__name__}). "
        f"On Debian or Ubuntu: {PACKAGES}"
    )
