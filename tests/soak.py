"""Four servers of 41 markers at 240 Hz, recorded at once: nothing may be lost, and memory must stay flat.

`python -m tests.soak --minutes 10` (`make soak`); everything is on loopback and stops by itself.
"""

from __future__ import annotations

import argparse
import re
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from retarget.frames import MarkerLayout
from retarget.markers.clip import MarkerClip
from retarget.markers.write_c3d import write_c3d
from retarget.take.analysis import inspect_take
from retarget.take.reader import read_take

SERVERS, MARKERS, RATE_HZ = 4, 41, 240.0
COMMAND = [sys.executable, "-m", "retarget"]
WARM_UP_S = 10.0
"""Until then memory grows as buffers fill."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """What one recorder did."""

    frames: int
    lost: int
    malformed: int
    grown_mb: float
    """Resident memory at the end, over that after the warm-up."""


def soak(seconds: float) -> list[Recorded]:
    """Serve and record for so long [s]."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        write_clip(folder / "take.c3d")
        addresses = [stack.enter_context(Served(folder / "take.c3d")).address for _ in range(SERVERS)]
        takes = [folder / f"take{i}.mcap" for i in range(SERVERS)]
        recorders = [
            stack.enter_context(subprocess.Popen([*COMMAND, "record", address, str(take)], stdout=subprocess.DEVNULL))
            for address, take in zip(addresses, takes, strict=True)
        ]
        for each in recorders:
            stack.callback(each.kill)
        time.sleep(min(WARM_UP_S, seconds / 3))
        early = [resident_mb(each.pid) for each in recorders]
        time.sleep(seconds - min(WARM_UP_S, seconds / 3))
        late = [resident_mb(each.pid) for each in recorders]
        for each in recorders:
            each.send_signal(signal.SIGINT)
        if any(each.wait(30) != 0 for each in recorders):
            raise RuntimeError("a recorder failed")
        return [judged(take, b - a) for take, a, b in zip(takes, early, late, strict=True)]


class Served:
    """A `retarget replay` process on a port of its own."""

    def __init__(self, take: Path) -> None:
        arguments = ["replay", str(take), "--port", "0", "--loop", "--rate", str(RATE_HZ)]
        self._server = subprocess.Popen(
            [*COMMAND, *arguments], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
        )
        found = re.search(r"natnet://\S+", self._server.stderr.readline() if self._server.stderr else "")
        if not found:
            raise RuntimeError("a server did not start")
        self.address = found[0]

    def __enter__(self) -> Served:
        return self

    def __exit__(self, *_: object) -> None:
        self._server.terminate()
        self._server.communicate(timeout=20)


def write_clip(path: Path) -> None:
    """Ten seconds of markers that wander."""
    rng = np.random.default_rng(4)
    steps = rng.normal(scale=2e-4, size=(2400, MARKERS, 3))
    places = rng.uniform(-0.1, 0.1, size=(MARKERS, 3)) + np.cumsum(steps, axis=0)
    layout = MarkerLayout("soak", tuple(f"marker{i}" for i in range(MARKERS)))
    write_c3d(path, MarkerClip(layout, RATE_HZ, places, path))


def resident_mb(pid: int) -> float:
    """Memory of a process [MB]."""
    found = re.search(r"VmRSS:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    return int(found[1]) / 1024 if found else float("nan")


def judged(take: Path, grown_mb: float) -> Recorded:
    """Read a take back and count."""
    frames = inspect_take(read_take(take)).frames
    return Recorded(frames.received, frames.lost, frames.malformed, grown_mb)


def main() -> int:
    """Print what each recorder did; 1 where a frame was lost or memory grew."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    results = soak(60 * parser.parse_args().minutes)
    for i, r in enumerate(results):
        print(f"recorder {i}: {r.frames:,} frames, {r.lost} lost, {r.malformed} malformed, {r.grown_mb:+.1f} MB")
    return int(any(result.lost or result.malformed or result.grown_mb > 5 for result in results))


if __name__ == "__main__":
    sys.exit(main())
