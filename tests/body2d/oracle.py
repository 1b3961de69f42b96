"""Video2Anim's own answers, where they are at hand, and folders of key points for tests."""

from __future__ import annotations

import functools
import gzip
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

ORACLE = Path(__file__).parents[2] / "../shared/data/oracles/video2anim_two-people.json.gz"
needs_oracle = pytest.mark.skipif(not ORACLE.exists(), reason="the recorded runs of Video2Anim are not at hand")


@functools.cache
def oracle() -> dict[str, Any]:
    answers: dict[str, Any] = json.loads(gzip.decompress(ORACLE.read_bytes()))
    return answers


def write_frames(folder: Path, frames: Sequence[object]) -> Path:
    """One file a frame, named as OpenPose does."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, frame in enumerate(frames):
        (folder / f"film_{number:012d}_keypoints.json").write_text(json.dumps(frame))
    return folder


def frame_of(*people: Mapping[int, tuple[float, ...]]) -> dict[str, object]:
    """A frame from each person's points: number -> (x, y) or (x, y, confidence); all else was not seen."""
    return {"version": 1.3, "people": [{"pose_keypoints_2d": _flat(points)} for points in people]}


def _flat(points: Mapping[int, tuple[float, ...]]) -> list[float]:
    values = [0.0] * 75
    for number, point in points.items():
        values[3 * number : 3 * number + 3] = [*point, *([1.0] if len(point) == 2 else [])]
    return values
