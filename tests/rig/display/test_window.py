"""The live window, on a screen of Xvfb: what a user would see there, and what he meets where there is no screen."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[3]

OPEN = """
from retarget.errors import DisplayError
from retarget.rig.display.window import Window
from tests.rig.display.heads import head_rig
try:
    with Window(head_rig()):
        print("opened")
except DisplayError as error:
    print(error)
"""


def test_a_user_sees_the_face_moves_it_and_quits(xvfb: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [
            xvfb,
            "-a",
            "-s",
            "-screen 0 800x600x24",
            sys.executable,
            "-m",
            "tests.rig.display.window_child",
            str(tmp_path),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout.splitlines()[-1])
    closing_s = seen.pop("closing_s")
    assert dict.fromkeys(seen, True) == seen
    assert closing_s < 10
    with Image.open(tmp_path / "face.png") as screen:
        face = np.asarray(screen)[:240, :320].astype(int)
    assert tuple(face[2, 2]) == (0, 255, 0)
    red = (face[..., 0] > 120) & (face[..., 0] > 3 * face[..., 1])
    rows, columns = np.nonzero(red)
    assert columns.mean() > 160 + 20
    assert rows.mean() < 120
    (saved,) = tmp_path.glob("ball head-*.png")
    with Image.open(saved) as picture:
        assert picture.size == (320, 240)


@pytest.mark.usefixtures("egl")
@pytest.mark.parametrize(
    ("display", "words"),
    [("", "There is no screen to open a window on"), (":4321", "No window can be opened on the screen")],
)
def test_without_a_screen_one_sentence_says_what_to_do(display: str, words: str) -> None:
    environment = os.environ | {"DISPLAY": display}
    done = subprocess.run(
        [sys.executable, "-c", OPEN], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(words)
    assert len(done.stdout.strip().splitlines()) == 1
