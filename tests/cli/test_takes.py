"""record, convert, inspect and replay of takes, as a user types them."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
TAKE = str(ROOT / "takes" / "demo.c3d")
CAPTURE = ROOT / "../shared/data/natnet/motive-2.1_natnet-3.0_session.pcapng"
COMMAND = [sys.executable, "-m", "retarget"]


def retarget(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, timeout=120, check=False, cwd=ROOT)


def served(*arguments: str) -> tuple[subprocess.Popen[str], str]:
    server = subprocess.Popen(
        [*COMMAND, "replay", *arguments, "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    found = re.search(r"natnet://\S+", server.stderr.readline() if server.stderr else "")
    assert found
    return server, found[0]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A live run that was also recorded: the take, and the poses that were solved live."""
    folder = tmp_path_factory.mktemp("recorded")
    server, address = served(TAKE, "--speed", "4")
    try:
        live = retarget("run", address, "--record", str(folder / "take.mcap"), "--to", str(folder / "live.csv"))
    finally:
        server.terminate()
        server.communicate(timeout=20)
    assert live.returncode == 0, live.stderr
    return folder / "take.mcap", folder / "live.csv"


def test_a_recorded_run_is_solved_again_to_the_same_bytes(recorded: tuple[Path, Path], tmp_path: Path) -> None:
    take, live = recorded
    again = retarget("run", str(take), "--to", str(tmp_path / "again.csv"))
    assert again.returncode == 0, again.stderr
    assert (tmp_path / "again.csv").read_bytes() == live.read_bytes()


def test_a_take_on_its_way_through_a_capture_gives_the_same_poses(recorded: tuple[Path, Path], tmp_path: Path) -> None:
    take, live = recorded
    converted = retarget("convert", str(take), str(tmp_path / "take.pcapng"))
    assert converted.returncode == 0, converted.stderr
    retarget("run", str(tmp_path / "take.pcapng"), "--to", str(tmp_path / "again.csv"))
    before, after = (np.loadtxt(p, delimiter=",", skiprows=1) for p in (live, tmp_path / "again.csv"))
    # a capture's clock counts nanoseconds, a take's more finely, so gaps are eased over a little by the rounding
    np.testing.assert_allclose(after[:, 2:], before[:, 2:], atol=1e-7)


@pytest.mark.parametrize("ending", [".c3d", ".trc", ".csv"])
def test_a_take_becomes_a_marker_file(recorded: tuple[Path, Path], tmp_path: Path, ending: str) -> None:
    target = tmp_path / f"take{ending}"
    run = retarget("convert", str(recorded[0]), str(target))
    assert run.returncode == 0, run.stderr
    facts = json.loads(retarget("inspect", str(target), "--json").stdout)
    assert facts["frames"]["received"] == 1200
    assert facts["rate_hz"] == pytest.approx(120, rel=0.01) or facts["rate_hz"] == pytest.approx(480, rel=0.01)
    assert len(facts["markers"]) == 24


def test_a_real_capture_is_inspected_and_drawn(tmp_path: Path) -> None:
    if not CAPTURE.exists():
        pytest.skip("the captured NatNet session is not beside the project")
    run = retarget("inspect", str(CAPTURE), "--json", "--plot", str(tmp_path / "plot.png"))
    assert run.returncode == 0, run.stderr
    facts = json.loads(run.stdout)
    assert (facts["frames"]["received"], facts["frames"]["lost"]) == (518, 0)
    assert facts["facts"]["bitstream"] == "3.0"
    assert (tmp_path / "plot.png").stat().st_size > 10_000
    text = retarget("inspect", str(CAPTURE)).stdout
    assert "518 frames at 120 Hz" in text


def test_a_real_capture_is_recorded_from_our_server(tmp_path: Path) -> None:
    if not CAPTURE.exists():
        pytest.skip("the captured NatNet session is not beside the project")
    server, address = served(str(CAPTURE), "--speed", "4")
    try:
        run = retarget("record", address, str(tmp_path / "take.mcap"))
    finally:
        server.terminate()
        server.communicate(timeout=20)
    assert run.returncode == 0, run.stderr
    facts = json.loads(retarget("inspect", str(tmp_path / "take.mcap"), "--json").stdout)
    assert (facts["frames"]["received"], facts["frames"]["lost"]) == (518, 0)


def test_a_take_is_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "take.mcap").write_bytes(b"the only one")
    run = retarget("record", "natnet://127.0.0.1:9", str(tmp_path / "take.mcap"))
    assert run.returncode == 1
    assert "take.mcap" in run.stderr
    assert (tmp_path / "take.mcap").read_bytes() == b"the only one"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("record", TAKE, "out.mcap"), "cannot be recorded"),
        (("convert", TAKE, "out.xyz"), "out.xyz"),
        (("convert", "none.c3d", "out.trc"), "none.c3d"),
        (("inspect", "none.mcap"), "none.mcap"),
        (("replay", "none.mcap"), "none.mcap"),
        (("replay", TAKE, "--bitstream", "9.9"), "9.9"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_sentence(arguments: tuple[str, ...], words: str) -> None:
    run = retarget(*arguments)
    assert run.returncode == 1
    assert words in run.stderr
    assert "Traceback" not in run.stderr
    assert len(run.stderr.strip().splitlines()) == 1
