"""The whole service on a live stream: memory over ten minutes of a take, frames lost, time from datagram to pose.

Ten minutes at 120 Hz are played at five times their speed, so it takes two minutes.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from tests.benchmarks.report import Row

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
SPEED = 5
MINUTES = 10
COMMAND = [sys.executable, "-m", "retarget"]


def rows() -> Iterator[Row]:
    """Start a server and the service, and watch the service's memory."""
    take = str(ROOT / "takes" / "demo.c3d")
    server = subprocess.Popen(
        [*COMMAND, "replay", take, "--loop", "--port", "0", "--speed", str(SPEED)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        found = re.search(r"natnet://\S+", server.stderr.readline() if server.stderr else "")
        if not found:
            raise SystemExit("The server did not start.")
        with tempfile.TemporaryDirectory() as folder:
            yield from _watched(found[0], str(Path(folder) / "poses.csv"))
    finally:
        server.terminate()
        server.communicate()


def _watched(address: str, poses: str) -> Iterator[Row]:
    seconds = MINUTES * 60 / SPEED
    run = subprocess.Popen(
        [*COMMAND, "run", address, "--to", poses, "--seconds", str(seconds), "--json"],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    time.sleep(seconds * 0.15)
    early = _resident_mb(run.pid)
    time.sleep(seconds * 0.8)
    late = _resident_mb(run.pid)
    report = json.loads(run.communicate(timeout=60)[0])
    yield Row("memory near the end of 10 minutes", late, "MB", "the same run after 1.5 minutes", early, "flat")
    yield Row("frames received", report["source"]["received"], "frames")
    yield Row("frames lost or dropped", report["source"]["lost"] + report["source"]["dropped"], "frames", aim="0")
    yield Row("datagram to pose, p50", report["latency_p50_ms"], "ms")
    yield Row("datagram to pose, p99", report["latency_p99_ms"], "ms")


def _resident_mb(pid: int) -> float:
    status = Path(f"/proc/{pid}/status").read_text()
    found = re.search(r"VmRSS:\s+(\d+) kB", status)
    return int(found[1]) / 1024 if found else float("nan")
