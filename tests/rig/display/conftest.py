"""Skips what needs a drawing context where the machine has none, and a screen where Xvfb is missing."""

from __future__ import annotations

import shutil

import pytest

from retarget.errors import DisplayError
from retarget.rig.display.platform import Context


@pytest.fixture(scope="session")
def egl() -> None:
    """Pass where EGL opens a context."""
    try:
        Context().close()
    except DisplayError as error:
        pytest.skip(f"EGL is missing here: {error}")


@pytest.fixture(scope="session")
def xvfb(egl: None) -> str:
    """The program that gives a command a screen of its own."""
    found = shutil.which("xvfb-run")
    if found is None or shutil.which("xauth") is None:
        pytest.skip("Xvfb is missing here; apt-get install -y --no-install-recommends xvfb xauth")
    return found
