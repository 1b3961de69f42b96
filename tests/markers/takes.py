"""Where the recordings are, and small takes whose truth is known."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import ezc3d
import numpy as np
import pytest

from retarget.frames import MarkerFrame, MarkerLayout
from retarget.geometry import transform

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

RECORDINGS = Path(__file__).parents[2] / "../shared/data"
JAW = "animface/jaw.c3d"
EYEBROWS = "animface/eyebrows.c3d"
HEADBAND = "headband/PiG_Motion-FlatFoot-Full.c3d"


def recording(name: str) -> Path:
    """The recording of that name; skips the test where it is absent."""
    path = RECORDINGS / name
    if not path.exists():
        pytest.skip(f"the recording {name} is not here")
    return path


def layout(*names: str) -> MarkerLayout:
    """A layout of a source that only has names."""
    return MarkerLayout("source", names)


def frame(
    positions: ArrayLike, number: int = 0, time_s: float | None = None, markers: MarkerLayout | None = None
) -> MarkerFrame:
    """One frame, by default at 100 frames a second."""
    places = np.array(positions, float)
    time_s = number / 100 if time_s is None else time_s
    if markers is None:
        markers = layout(*(f"m{i}" for i in range(len(places))))
    return MarkerFrame(number, time_s, time_s, markers, places)


def frames(positions: Array, markers: MarkerLayout | None = None, rate_hz: float = 100.0) -> Iterator[MarkerFrame]:
    """Frames of a take (N, M, 3)."""
    if markers is None:
        markers = layout(*(f"m{i}" for i in range(positions.shape[1])))
    return (frame(places, i, i / rate_hz, markers) for i, places in enumerate(positions))


def motion(rng: np.random.Generator, turn_rad: float = 0.5, shift_m: float = 0.5) -> Array:
    """A random rigid motion (4, 4)."""
    axis = rng.normal(size=3)
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = rng.uniform(-turn_rad, turn_rad)
    R = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross  # Rodrigues
    return transform(R, rng.uniform(-shift_m, shift_m, 3))


def write_c3d(
    path: Path,
    positions: Array,
    labels: Sequence[str],
    unit: str = "mm",
    rate_hz: float = 100.0,
    screen: tuple[str, str] | None = None,
    computed: Sequence[str] = (),
) -> Path:
    """A C3D file of `positions` (N, M, 3) in `unit`, written by ezc3d; NaN is written as it writes gaps."""
    take = ezc3d.c3d()
    points = np.ones((4, positions.shape[1], positions.shape[0]))
    points[:3] = positions.transpose(2, 1, 0)
    take["data"]["points"] = points
    point = take["parameters"]["POINT"]
    point["RATE"]["value"] = [rate_hz]
    point["UNITS"]["value"] = [unit]
    point["LABELS"]["value"] = list(labels[:255])
    if len(labels) > 255:
        take.add_parameter("POINT", "LABELS2", list(labels[255:]))
    if screen is not None:
        take.add_parameter("POINT", "X_SCREEN", [screen[0]])
        take.add_parameter("POINT", "Y_SCREEN", [screen[1]])
    if computed:
        take.add_parameter("POINT", "ANGLES", list(computed))
    take.write(str(path))
    return path
