"""One PNG file a pose, named by its number, with the exact chroma."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from retarget.errors import OutputError
from retarget.rig.display.frames import FramesSink
from retarget.rig.display.offscreen import Offscreen
from retarget.rig.display.view import View
from tests.rig.display.heads import head_pose, head_rig

if TYPE_CHECKING:
    from pathlib import Path

VIEW = View(64, 48)


@pytest.mark.usefixtures("egl")
def test_every_pose_becomes_a_picture_named_by_its_number(tmp_path: Path) -> None:
    rig, folder = head_rig(), tmp_path / "deep" / "frames"
    with FramesSink(folder, rig, VIEW) as sink:
        for number in (5, 420, 1_234_567):
            sink(head_pose(rig, yaw_rad=number / 1e6, number=number))
    assert sorted(p.name for p in folder.iterdir()) == ["000005.png", "000420.png", "1234567.png"]
    with Image.open(folder / "000420.png") as image:
        pixels = np.asarray(image)
    assert pixels.shape == (48, 64, 3)
    assert tuple(pixels[0, 0]) == (0, 255, 0)
    with Offscreen(rig, VIEW) as offscreen:
        assert (pixels == offscreen.render(head_pose(rig, yaw_rad=420 / 1e6))).all()


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with (
        pytest.raises(OutputError, match=r"Cannot make the folder .*file/frames"),
        FramesSink(tmp_path / "file" / "frames", head_rig(), VIEW),
    ):
        pass
