"""`retarget run` and `retarget replay` as processes of their own, on loopback."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest

from retarget.errors import DisplayError
from retarget.rig.display.platform import Context

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
TAKE = str(ROOT / "takes" / "demo.c3d")
JAW = ROOT / "../shared/data/animface/jaw.c3d"
COMMAND = [sys.executable, "-m", "retarget"]


def retarget(*arguments: str, seconds: float = 120) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMMAND, *arguments], capture_output=True, text=True, timeout=seconds, check=False, cwd=ROOT
    )


def table(path: Path) -> dict[str, np.ndarray]:
    names = path.read_text().splitlines()[0].split(",")
    values = np.loadtxt(path, delimiter=",", skiprows=1)
    return {name: values[:, i] for i, name in enumerate(names)}


@pytest.fixture
def egl() -> None:
    try:
        Context().close()
    except DisplayError as error:
        pytest.skip(f"no picture can be drawn here: {error}")


@pytest.fixture
def replayed(request: pytest.FixtureRequest) -> Iterator[str]:
    """The address of a server that plays a take."""
    arguments = [*COMMAND, "replay", *request.param, "--port", "0"]
    server = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    try:
        assert server.stderr
        found = re.search(r"natnet://\S+", server.stderr.readline())
        assert found, server.communicate()
        yield found[0]
    finally:
        server.terminate()
        server.communicate(timeout=20)


def test_a_take_becomes_a_film_pictures_and_a_table_in_one_run(tmp_path: Path, egl: None) -> None:
    film, stills, poses = tmp_path / "out.mp4", tmp_path / "frames", tmp_path / "poses.csv"
    run = retarget(
        "run", TAKE, "--to", str(film), "--to", f"{stills}/", "--to", str(poses),
        "--size", "160x120", "--antialias", "1", "--fps", "12", "--background", "#0000ff", "--json",
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    report = json.loads(run.stdout)
    assert report["poses"] == report["source"]["received"] == 1200
    video = cv2.VideoCapture(str(film))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 120
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(12)
    numbers = [int(path.stem) for path in sorted(stills.glob("*.png"))]
    assert numbers == list(range(0, 1200, 10))
    picture = cv2.imread(str(stills / "000000.png"))
    assert picture is not None
    assert picture.shape == (120, 160, 3)
    assert picture[2, 2].tolist() == [255, 0, 0]
    np.testing.assert_array_equal(table(poses)["frame"], np.arange(1200))


def test_options_in_a_file_are_options(tmp_path: Path) -> None:
    (tmp_path / "session.toml").write_text(f'source = "{TAKE}"\nto = ["{tmp_path}/poses.csv"]\njaw = "cosine"\n')
    run = retarget("run", "--config", str(tmp_path / "session.toml"))
    assert run.returncode == 0, run.stderr
    jaw = table(tmp_path / "poses.csv")
    angle = 2 * np.arctan2(jaw["jaw.qx"], jaw["jaw.qw"])
    assert (angle >= 0).all()  # the law of cosines has no sign


@pytest.mark.parametrize("replayed", [(str(JAW), "--speed", "4")], indirect=True)
def test_a_replayed_take_gives_the_poses_of_the_direct_run(tmp_path: Path, replayed: str) -> None:
    if not JAW.exists():
        pytest.skip("the real recording jaw.c3d is not beside the project")
    live = retarget("run", replayed, "--to", str(tmp_path / "live.csv"), "--json")
    assert live.returncode == 0, live.stderr
    source = json.loads(live.stdout)["source"]
    assert (source["received"], source["lost"], source["dropped"]) == (1590, 0, 0)
    direct = retarget("run", str(JAW), "--to", str(tmp_path / "direct.csv"))
    assert direct.returncode == 0, direct.stderr
    a, b = table(tmp_path / "live.csv"), table(tmp_path / "direct.csv")
    assert a.keys() == b.keys()
    for name in a.keys() - {"time_s"}:
        assert np.abs(a[name] - b[name]).max() < (1e-5 if ".t" in name else 5e-5), name


@pytest.mark.parametrize("replayed", [(TAKE, "--loop")], indirect=True)
@pytest.mark.parametrize("interrupt", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_leaves_whole_files(
    tmp_path: Path, replayed: str, interrupt: signal.Signals, egl: None
) -> None:
    film, poses = tmp_path / "out.mp4", tmp_path / "poses.csv"
    arguments = ["run", replayed, "--to", str(film), "--to", str(poses), "--size", "160x120"]
    run = subprocess.Popen([*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    wait_for_rows(poses, 200)
    run.send_signal(interrupt)
    _, errors = run.communicate(timeout=60)
    assert run.returncode == 0, errors
    rows = poses.read_text().splitlines()
    assert len({row.count(",") for row in rows}) == 1
    video = cv2.VideoCapture(str(film))
    pictures = 0
    while video.read()[0]:
        pictures += 1
    assert pictures == pytest.approx((len(rows) - 1) / 2, abs=2)


def wait_for_rows(path: Path, rows: int) -> None:
    for _ in range(600):
        if path.exists() and path.read_text().count("\n") > rows:
            return
        time.sleep(0.05)
    raise TimeoutError(path)


def test_seconds_end_a_live_run(tmp_path: Path) -> None:
    server = subprocess.Popen(
        [*COMMAND, "replay", TAKE, "--loop", "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert server.stderr
        found = re.search(r"natnet://\S+", server.stderr.readline())
        assert found
        run = retarget("run", found[0], "--to", str(tmp_path / "p.csv"), "--seconds", "2", "--json")
    finally:
        server.terminate()
        server.communicate(timeout=20)
    assert run.returncode == 0, run.stderr
    assert 150 < json.loads(run.stdout)["poses"] < 400


def test_the_rigs_are_listed() -> None:
    rigs = {rig["name"]: rig for rig in json.loads(retarget("rigs", "--json").stdout)}
    assert rigs["human"]["sites"] == 41
    assert rigs["human"]["shapes"] == 52
    assert "human" in retarget("rigs").stdout
