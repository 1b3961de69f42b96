"""Sinks behind queues: none stalls another, none loses without counting, errors stay where they happen."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from retarget.child import ChildSink
from retarget.errors import OutputError, RetargetError
from retarget.export.csv import PosesCsv
from retarget.outlets import Backlog, Outlet
from tests.poses import make_pose

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

    from retarget.frames import Pose
    from retarget.outlets import Sink


@contextmanager
def collecting(into: list[int], gate: threading.Event | None = None) -> Iterator[Sink]:
    def sink(pose: Pose) -> None:
        if gate:
            gate.wait(10)
        into.append(pose.number)

    yield sink
    into.append(-1)


@contextmanager
def failing_at(number: int) -> Iterator[Sink]:
    def sink(pose: Pose) -> None:
        if pose.number == number:
            raise OutputError("The disk is full.")

    yield sink


@contextmanager
def not_opening() -> Iterator[Sink]:
    raise OutputError("out.mp4 cannot be written.")
    yield


def test_poses_arrive_in_order_and_the_sink_is_closed() -> None:
    seen: list[int] = []
    outlet = Outlet("list", partial(collecting, seen), Backlog.WAIT, 4)
    outlet.start()
    for n in range(100):
        outlet.put(make_pose(n))
    assert outlet.finish()
    assert seen == [*range(100), -1]
    assert (outlet.written, outlet.dropped) == (100, 0)


def test_a_stuck_sink_keeps_the_newest_poses_and_counts_the_others() -> None:
    gate, seen = threading.Event(), list[int]()
    outlet = Outlet("slow", partial(collecting, seen, gate), Backlog.DROP_OLDEST, 3)
    outlet.start()
    outlet.put(make_pose(0))
    while outlet.waiting:
        threading.Event().wait(0.001)
    for n in range(1, 11):
        outlet.put(make_pose(n))
    gate.set()
    outlet.finish()
    assert seen == [0, 8, 9, 10, -1]
    assert outlet.dropped == 7


def test_a_sink_that_does_not_open_says_so_at_once() -> None:
    outlet = Outlet("film", not_opening, Backlog.WAIT, 1)
    outlet.start()
    with pytest.raises(OutputError, match=r"out\.mp4"):
        outlet.wait_open()
    with pytest.raises(OutputError, match=r"out\.mp4"):
        outlet.check_opening()


def test_an_error_closes_one_sink_and_never_blocks_the_source() -> None:
    outlet = Outlet("film", partial(failing_at, 3), Backlog.WAIT, 2)
    outlet.start()
    for n in range(50):
        outlet.put(make_pose(n))
    outlet.finish()
    assert outlet.written == 3
    assert str(outlet.error) == "The disk is full."


def test_an_abandoned_sink_closes_with_what_it_has() -> None:
    gate, seen = threading.Event(), list[int]()
    outlet = Outlet("slow", partial(collecting, seen, gate), Backlog.WAIT, 100)
    outlet.start()
    for n in range(20):
        outlet.put(make_pose(n))
    outlet.abandon()
    gate.set()
    assert outlet.finish()
    assert seen[-1] == -1
    assert outlet.written + outlet.dropped == 20


def open_table(path: str) -> PosesCsv:
    return PosesCsv(Path(path), ("head",), ())


def test_a_sink_in_another_process_writes_all(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    with ChildSink(open_table, str(path)) as sink:
        for n in range(500):
            sink(make_pose(n, joints=1, shapes=0))
    assert len(path.read_text().splitlines()) == 501


def test_what_the_other_process_cannot_open_is_raised_here(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"), ChildSink(open_table, str(tmp_path / "no" / "p.csv")):
        pass


def open_failing(number: int) -> AbstractContextManager[Sink]:
    return failing_at(number)


def test_an_error_in_the_other_process_is_raised_here() -> None:
    def feed() -> None:
        with ChildSink(open_failing, 5) as sink:
            for n in range(100_000):
                sink(make_pose(n))

    with pytest.raises(RetargetError, match="disk is full"):
        feed()


KILLED = """
import os, signal, sys
from tests.poses import make_pose
from tests.test_outlets import open_table
from retarget.child import ChildSink
if __name__ == "__main__":
    sink = ChildSink(open_table, sys.argv[1]).__enter__()
    for n in range(200):
        sink(make_pose(n, joints=1, shapes=0))
    print(sink._process.pid, flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_file_is_completed_when_the_program_is_killed(tmp_path: Path) -> None:
    (tmp_path / "killed.py").write_text(KILLED)
    path = tmp_path / "poses.csv"
    root = Path(__file__).parents[1]
    run = subprocess.run(
        [sys.executable, str(tmp_path / "killed.py"), str(path)],
        env={**os.environ, "PYTHONPATH": str(root)}, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert run.returncode == -signal.SIGKILL
    wait_for_end(int(run.stdout))
    assert len(path.read_text().splitlines()) == 201


def wait_for_end(pid: int) -> None:
    for _ in range(1000):
        try:
            if Path(f"/proc/{pid}/stat").read_text().split()[2] == "Z":
                return
        except FileNotFoundError:
            return
        threading.Event().wait(0.01)
    raise TimeoutError(pid)
