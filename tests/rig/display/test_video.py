"""Videos are read back by OpenCV's decoder: number, size, rate and content of their pictures."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from retarget.errors import DisplayError, InputError, OutputError
from retarget.rig.display.offscreen import Offscreen
from retarget.rig.display.video import Mp4Sink
from retarget.rig.display.view import View
from tests.rig.display.heads import head_pose, head_rig

VIEW = View(160, 120)
RIG = head_rig()
ROOT = Path(__file__).parents[3]
ENDLESS = """
import itertools, sys
from pathlib import Path
from retarget.rig.display.video import Mp4Sink
from tests.rig.display.heads import head_pose, head_rig
from tests.rig.display.test_video import VIEW
rig = head_rig()
with Mp4Sink(Path(sys.argv[1]), rig, 30, VIEW) as sink:
    for i in itertools.count():
        sink(head_pose(rig, yaw_rad=i / 10, number=i))
        print(i, flush=True)
"""


def read_back(path: Path) -> tuple[list[np.ndarray], float]:
    """The pictures (H, W, 3), sRGB, and the rate [Hz]."""
    video = cv2.VideoCapture(str(path))
    pictures = []
    while (got := video.read())[0]:
        pictures.append(got[1][..., ::-1])
    rate_hz = video.get(cv2.CAP_PROP_FPS)
    video.release()
    return pictures, rate_hz


@pytest.mark.usefixtures("egl")
@pytest.mark.parametrize("fps", [24.0, 59.94, 60.0])
def test_every_pose_is_one_picture_at_the_rate_given(tmp_path: Path, fps: float) -> None:
    path = tmp_path / "out.mp4"
    with Mp4Sink(path, RIG, fps, VIEW) as sink:
        for i in range(12):
            sink(head_pose(RIG, yaw_rad=i / 12, number=i * 2))
    pictures, rate_hz = read_back(path)
    assert len(pictures) == 12
    assert rate_hz == pytest.approx(fps, rel=1e-3)
    with Offscreen(RIG, VIEW) as offscreen:
        last = offscreen.render(head_pose(RIG, yaw_rad=11 / 12))
    assert pictures[-1].shape == (120, 160, 3)
    assert np.abs(pictures[-1].astype(int) - last).mean() < 6
    assert np.abs(pictures[-1][0, 0].astype(int) - (0, 255, 0)).max() <= 2


@pytest.mark.usefixtures("egl")
def test_an_interrupted_video_can_be_played(tmp_path: Path) -> None:
    """A process draws until Ctrl-C reaches it, as on the command line."""
    path = tmp_path / "out.mp4"
    with subprocess.Popen(
        [sys.executable, "-c", ENDLESS, str(path)],
        cwd=ROOT,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as child:
        assert child.stdout is not None
        while child.stdout.readline().strip() not in ("20", ""):
            pass
        child.send_signal(signal.SIGINT)
        written = len(child.stdout.read().split()) + 21
        child.wait(timeout=30)
    assert abs(len(read_back(path)[0]) - written) <= 1  # the last may be written and not yet told


@pytest.mark.usefixtures("egl")
def test_a_full_disk_is_told(tmp_path: Path) -> None:
    """The system refuses to let the file grow beyond 20 kB."""
    full = "import resource, signal\nsignal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n" + ENDLESS.replace(
        "    for", "    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))\n    for"
    ).replace("itertools.count()", "range(100)")
    done = subprocess.run(
        [sys.executable, "-c", full, str(tmp_path / "out.mp4")], cwd=ROOT, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 1
    last_line = done.stderr.strip().splitlines()[-1]
    assert re.fullmatch(r".*OutputError: The video .* holds 0 of 100 pictures; is the disk full\?", last_line)
    assert "moov" not in done.stderr


@pytest.mark.usefixtures("egl")
def test_where_nothing_can_be_drawn_no_empty_file_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EGL_DEVICE_ID", "99")
    with pytest.raises(DisplayError), Mp4Sink(tmp_path / "out.mp4", RIG, 60, VIEW):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("egl")
def test_a_run_without_poses_leaves_no_file_and_says_so(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="not one pose"), Mp4Sink(tmp_path / "out.mp4", RIG, 60, VIEW):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "reason"), [("nowhere/out.mp4", "No such file or directory"), ("taken.mp4", "Is a directory")]
)
def test_a_path_that_cannot_be_written_is_named_with_the_reason(tmp_path: Path, name: str, reason: str) -> None:
    (tmp_path / "taken.mp4").mkdir()
    with (
        pytest.raises(OutputError, match=rf"Cannot write the video .*{name}: {reason}"),
        Mp4Sink(tmp_path / name, RIG, 60, VIEW),
    ):
        pass


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_named(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="Permission denied"), Mp4Sink(tmp_path / "out.mp4", RIG, 60, VIEW):
        pass


@pytest.mark.parametrize("fps", [0.0, -1.0, float("nan"), float("inf"), 1000.0])
def test_a_rate_that_is_none_is_refused(tmp_path: Path, fps: float) -> None:
    with pytest.raises(InputError, match="pictures a second"):
        Mp4Sink(tmp_path / "out.mp4", RIG, fps, VIEW)


def test_an_odd_size_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="even"):
        Mp4Sink(tmp_path / "out.mp4", RIG, 60, View(161, 120))
