"""From a frame in the world to a filled one in the head's frame; the aim is for stabilising and solving together.

The peer aligns the same head markers once, with scipy; ours does so robustly, two times, and carries the face along.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from retarget.frames import MarkerFrame, MarkerLayout
from retarget.geometry import kabsch
from retarget.markers import Filler, Labeller, Stabiliser, StillMoment, load_layout
from tests.benchmarks.report import Row, seconds_per_call

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

RATE_HZ = 120.0
FRAMES = 1200
NOISE_M = 1e-4


def rows() -> Iterator[Row]:
    """Time per frame of each stage."""
    layout = load_layout("face24")
    rest = layout.markers.rest
    assert rest is not None
    take = _take(rest, layout.markers)
    head = list(layout.markers.head)
    stabilise = Stabiliser(rest[head], head)
    steady = [stabilise(frame) for frame in take]
    lost = [_without(frame, 20) for frame in steady]

    reverse = MarkerFrame(0, 0, 0, MarkerLayout("reversed", layout.markers.names[::-1]), rest[::-1])
    yield _row("label, 24 markers", _cycling(Labeller(layout), [reverse]))
    yield Row(
        "stabilise, 4 of 24 markers",
        _micros(_cycling(stabilise, take)),
        "µs",
        "scipy align_vectors, 4 points",
        _micros(lambda: Rotation.align_vectors(take[0].positions[head], rest[head])),
        "< 100",
    )
    yield _row("stabilise, one head marker 20 mm off", _cycling(Stabiliser(rest[head], head), _with_stray(take)))
    yield _row("general Kabsch fit, 4 points", lambda: kabsch(rest[head], take[0].positions[head]))
    yield _row("fill, nothing missing", _cycling(Filler(rest), steady))
    yield _row("fill, one marker missing", _cycling(Filler(rest), lost))
    yield _row("look for a still moment", _cycling(StillMoment(face_m=0.0, give_up=10**9).feed, take))


def _take(rest: Array, markers: MarkerLayout) -> list[MarkerFrame]:
    """A head that nods and turns, with noise."""
    rng = np.random.default_rng(0)
    time_s = np.arange(FRAMES) / RATE_HZ
    turns = np.stack([0.2 * np.sin(5 * time_s), 0.3 * np.sin(3 * time_s), 0.05 * np.sin(7 * time_s)], axis=1)
    places = np.array([Rotation.from_rotvec(turn).apply(rest) for turn in turns]) + np.array([0.2, 1.5, 0.1])
    places += rng.normal(size=places.shape) * NOISE_M
    return [MarkerFrame(i, t, t, markers, p) for i, (t, p) in enumerate(zip(time_s.tolist(), places, strict=True))]


def _without(frame: MarkerFrame, marker: int) -> MarkerFrame:
    places = frame.positions.copy()
    places[marker] = np.nan
    return MarkerFrame(frame.number, frame.time_s, frame.received_s, frame.layout, places, frame.T_world_head)


def _with_stray(take: list[MarkerFrame]) -> list[MarkerFrame]:
    strays = []
    for frame in take:
        places = frame.positions.copy()
        places[1, 1] += 0.02 * (frame.number > 0)
        strays.append(MarkerFrame(frame.number, frame.time_s, frame.received_s, frame.layout, places))
    return strays


def _cycling(stage: Callable[[MarkerFrame], object], take: list[MarkerFrame]) -> Callable[[], object]:
    frames = itertools.cycle(take)
    return lambda: stage(next(frames))


def _row(what: str, call: Callable[[], object]) -> Row:
    return Row(what, _micros(call), "µs")


def _micros(call: Callable[[], object]) -> float:
    return 1e6 * seconds_per_call(call, repeat=FRAMES - 10)
