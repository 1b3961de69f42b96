"""Pictures on disk are exact and whole; Pillow is the independent reader."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from retarget.errors import OutputError
from retarget.rig.display.pictures import save_picture

if TYPE_CHECKING:
    from pathlib import Path


def test_a_picture_reads_back_as_it_was(tmp_path: Path) -> None:
    picture = np.random.default_rng(1).integers(0, 256, (17, 23, 3), np.uint8)
    save_picture(tmp_path / "a.png", picture)
    with Image.open(tmp_path / "a.png") as image:
        assert image.mode == "RGB"
        assert (np.asarray(image) == picture).all()
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]


def test_a_picture_replaces_an_older_one(tmp_path: Path) -> None:
    for grey in (10, 200):
        save_picture(tmp_path / "a.png", np.full((4, 4, 3), grey, np.uint8))
    with Image.open(tmp_path / "a.png") as image:
        assert image.getpixel((0, 0)) == (200, 200, 200)


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"Cannot write the picture .*nowhere/a.png: No such file"):
        save_picture(tmp_path / "nowhere" / "a.png", np.zeros((4, 4, 3), np.uint8))


def test_a_full_disk_is_named_and_leaves_the_older_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_picture(tmp_path / "a.png", np.zeros((4, 4, 3), np.uint8))

    def full(self: Path, data: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    with pytest.raises(OutputError, match="No space left on device"):
        save_picture(tmp_path / "a.png", np.full((4, 4, 3), 9, np.uint8))
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]
