"""From markers to a pose of the rig: the joint mapping alone, and with the stages before it, for one frame."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from retarget.markers.fill import Filler
from retarget.markers.stabilise import Stabiliser
from retarget.rig.fit import performer_from_neutral
from retarget.rig.joints import JointMapping
from tests.benchmarks.report import Row, seconds_per_call
from tests.synthetic.capture import captured
from tests.synthetic.face import ALL_SITES, face_layout, make_face
from tests.synthetic.motion import everything
from tests.synthetic.rig import small_rig

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from retarget.frames import MarkerFrame, MarkerLayout

FRAMES = 1200


def rows() -> Iterator[Row]:
    """p50 over the frames of a busy performance, for the sizes of the two layouts that ship."""
    for layout in (face_layout(), face_layout("animface41", ALL_SITES)):
        yield from _rows_for(layout)


def _rows_for(layout: MarkerLayout) -> Iterator[Row]:
    rng = np.random.default_rng(1)
    face = make_face(small_rig(), layout, rng)
    take = captured(face, everything(face.rig, np.arange(FRAMES) / 120, rng))
    in_world, in_head = list(take.frames()), list(take.stabilised())
    mapping = JointMapping(face.rig, layout, face.performer)
    stabilise = Stabiliser(face.performer.head_template, layout.head)
    fill = Filler(face.performer.neutral)

    markers = len(layout.names)
    solving = _median_us(mapping, in_head)
    yield Row(f"solve, {markers} markers, p50 of one frame", solving, "us", aim="< 80")
    whole = _median_us(lambda frame: mapping(fill(stabilise(frame))), in_world)
    yield Row(f"stabilise, fill and solve, {markers} markers, p50 of one frame", whole, "us", aim="< 200")
    world = in_world[0].positions
    fitting = seconds_per_call(lambda: performer_from_neutral(layout, world, face.rig), repeat=20)
    yield Row(f"a performer from the neutral, {markers} markers", 1e3 * fitting, "ms")


def _median_us(call: Callable[[MarkerFrame], object], frames: Sequence[MarkerFrame]) -> float:
    durations = np.empty(len(frames))
    for i, frame in enumerate(frames):
        start = time.perf_counter()
        call(frame)
        durations[i] = time.perf_counter() - start
    return float(1e6 * np.median(durations))
