"""Where drawing is impossible, one sentence says why and what to do.

Each case is a process of its own, since PyOpenGL binds to a platform once.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
DRAW = """
from retarget.errors import DisplayError
from retarget.rig.display.platform import Context
try:
    Context().close()
    print("drawn")
except DisplayError as error:
    print(error)
"""


def run(program: str, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_importing_the_display_loads_no_drawing_library() -> None:
    modules = "display.window", "display.video", "display.frames", "display.offscreen", "display.platform"
    imports = "".join(f"import retarget.rig.{module}\n" for module in modules)
    heavy = "pyrender", "OpenGL", "pyglet", "trimesh", "cv2", "PIL", "scipy"
    assert run(f"{imports}import sys\nprint([m for m in {heavy} if m in sys.modules])") == "[]"


@pytest.mark.usefixtures("egl")
def test_no_variable_has_to_be_set_to_draw() -> None:
    assert run(DRAW) == "drawn"


def test_a_missing_egl_is_named_with_the_packages_to_install() -> None:
    hide_egl = """
import ctypes
load = ctypes.CDLL.__init__
def without_egl(self, name, *args, **kwargs):
    if name and "EGL" in str(name):
        raise OSError(f"{name}: cannot open shared object file")
    load(self, name, *args, **kwargs)
ctypes.CDLL.__init__ = without_egl
"""
    said = run(hide_egl + DRAW)
    assert "EGL is missing" in said
    assert "apt-get install -y --no-install-recommends libegl1" in said


@pytest.mark.usefixtures("egl")
def test_an_egl_without_any_driver_is_named_with_the_packages_to_install() -> None:
    said = run(DRAW, __EGL_VENDOR_LIBRARY_FILENAMES="/dev/null")
    assert "EGL opens no OpenGL" in said
    assert "libgl1-mesa-dri" in said


@pytest.mark.usefixtures("egl")
def test_a_device_that_does_not_exist_is_named() -> None:
    assert "EGL_DEVICE_ID is '99'" in run(DRAW, EGL_DEVICE_ID="99")


@pytest.mark.usefixtures("egl")
def test_opengl_loaded_before_for_another_platform_is_named() -> None:
    before = "import os\nos.environ['PYOPENGL_PLATFORM'] = 'x11'\nimport OpenGL.platform\n"
    assert "PYOPENGL_PLATFORM=egl" in run(before + DRAW)
