"""Marker frames that leave one run by UDP and enter another."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from retarget.udp.landmark_source import LandmarkSource

ROOT = Path(__file__).parents[2]
TAKE = str(ROOT / "takes" / "demo.c3d")
COMMAND = [sys.executable, "-m", "retarget"]


def test_a_take_is_sent_on_at_its_own_speed_frame_by_frame() -> None:
    with LandmarkSource("udp://127.0.0.1:0") as source:
        sender = subprocess.Popen(
            [*COMMAND, "run", TAKE, "--to", f"udp://127.0.0.1:{source.address[1]}", "--seconds", "2", "--json"],
            stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        frames = [frame for _, frame in zip(range(100), source, strict=False)]
        source.stop()
        report = json.loads(sender.communicate(timeout=30)[0])
    assert sender.returncode == 0
    assert report["poses"] == 0
    assert report["latency_p50_ms"] is None
    assert frames[0].layout.names[:2] == ("headFrontLeft", "headFrontRight")
    steps = np.diff([frame.time_s for frame in frames])
    assert np.median(steps) == pytest.approx(1 / 120, rel=0.1)
    assert np.isfinite(frames[0].positions).all()
