"""From marker frames in the capture volume to poses of one rig: label, find the neutral, stabilise, fill, solve.

Without a performer file the first still moment of the stream is the neutral; frames that come before it is found wait
and are solved then, so none is lost. The same frames give the same poses, bit for bit, live or from a file.
"""

from __future__ import annotations

import logging
from collections import deque
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError, RetargetError
from retarget.markers.fill import Filler
from retarget.markers.label import Labeller
from retarget.markers.layouts import detect_layout, load_layout
from retarget.markers.neutral import StillMoment
from retarget.markers.stabilise import Stabiliser
from retarget.rig.drive import Drive
from retarget.rig.fit import performer_from_neutral

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame, MarkerLayout, Pose
    from retarget.markers.layouts import Layout
    from retarget.markers.neutral import Neutral
    from retarget.performer import JawMode, Performer
    from retarget.rig.drive import DriveMode
    from retarget.rig.model import Rig
    from retarget.rig.pose_smoother import Smoothing

    Array = NDArray[np.float64]

log = logging.getLogger("retarget.session")

MOST_WAITING = 6000
"""Frames kept until the neutral is found; on a stage where nobody is in view yet, older ones are let go."""


@dataclass(frozen=True, slots=True)
class SolveSettings:
    """How markers move the face, besides what the performer says."""

    drive: DriveMode = "joints"
    smooth: Smoothing = "none"
    jaw: JawMode | None = None
    """How the jaw's angle is read; None as the performer has it."""


class Session:
    """One performance on one rig. Feed it every frame in order; it answers with the poses that are ready."""

    def __init__(
        self,
        rig: Rig,
        performer: Performer | None = None,
        layout: Layout | None = None,
        how: SolveSettings | None = None,
        updates: Callable[[], Performer | None] = lambda: None,
    ) -> None:
        """`layout` is found from the first frame's names where neither it nor a performer tells it.

        `updates` is asked before every frame for a performer that was edited meanwhile.
        """
        self._rig = rig
        self._how = how or SolveSettings()
        self._updates = updates
        self._layout = layout or (load_layout(performer.layout) if performer else None)
        self._labeller: Labeller | None = None
        self._still: StillMoment | None = None
        self._waiting: deque[MarkerFrame] = deque(maxlen=MOST_WAITING)
        self._solver: _Solver | None = None
        self.performer = performer
        """Who performs: the calibration given, or the one made of the neutral once it is found."""

    def __call__(self, frame: MarkerFrame) -> list[Pose]:
        """The poses that `frame` makes possible: usually its own; none before the neutral is found, then all that
        waited.
        """
        edited = self._updates()
        if edited is not None:
            self._adopt(edited)
        labelled = self._label(frame)
        if self._solver is None:
            self._waiting.append(labelled)
            self._solver = self._prepare(labelled)
            return self._solve_waiting() if self._solver else []
        return [self._solver(labelled)]

    def finish(self) -> list[Pose]:
        """The poses of what still waits when the stream ends: a stream that never rested takes its quietest moment."""
        if self._solver is None and self._still is not None and self._waiting:
            self._solver = self._from_neutral(self._waiting[0].layout, self._still.settle())
        return self._solve_waiting() if self._solver else []

    def _label(self, frame: MarkerFrame) -> MarkerFrame:
        if self._labeller is None:
            self._labeller = Labeller(self._layout or detect_layout(frame.layout.names))
        return self._labeller(frame)

    def _prepare(self, labelled: MarkerFrame) -> _Solver | None:
        if self.performer is not None:
            return self._from_performer(labelled, self.performer)
        self._still = self._still or StillMoment()
        neutral = self._still.feed(labelled)
        return None if neutral is None else self._from_neutral(labelled.layout, neutral)

    def _from_neutral(self, layout: MarkerLayout, neutral: Neutral) -> _Solver:
        performer, T_world_head = performer_from_neutral(layout, neutral.positions, self._rig, noise=neutral.spread_m)
        log.info("Neutral found in frames %d to %d.", neutral.first_number, neutral.last_number)
        self.performer = self._as_asked(performer)
        return _Solver(self._rig, layout, self.performer, T_world_head, self._how)

    def _from_performer(self, labelled: MarkerFrame, performer: Performer) -> _Solver | None:
        """The first frame that shows the head says which way it looks when it looks straight ahead."""
        layout = labelled.layout
        neutral = neutral_in(layout, performer)
        stabilised = Stabiliser(neutral[list(layout.head)], layout.head)(labelled)
        if not np.isfinite(stabilised.positions).any() or stabilised.T_world_head is None:
            return None
        self.performer = self._as_asked(performer)
        return _Solver(self._rig, layout, self.performer, stabilised.T_world_head, self._how)

    def _adopt(self, performer: Performer) -> None:
        """Go on with another calibration from the next frame; if it does not fit, say so and keep the old one."""
        performer = self._as_asked(performer)
        try:
            if self._solver is not None:
                self._solver = self._solver.with_performer(performer)
        except RetargetError as error:
            log.warning("The performer stays as it was: %s", error)
            return
        self.performer = performer
        log.warning("The performer %s was read again.", performer.name)

    def _as_asked(self, performer: Performer) -> Performer:
        if self._how.jaw is None or performer.jaw is None:
            return performer
        return replace(performer, jaw=replace(performer.jaw, mode=self._how.jaw))

    def _solve_waiting(self) -> list[Pose]:
        frames = [*self._waiting]
        self._waiting.clear()
        return [self._solver(frame) for frame in frames] if self._solver else []


class _Solver:
    """The stages that need to know the neutral."""

    def __init__(
        self, rig: Rig, layout: MarkerLayout, performer: Performer, T_world_reference: Array, how: SolveSettings
    ) -> None:
        self._neutral = neutral_in(layout, performer)
        self._for_performer = partial(
            Drive, rig, layout, T_world_reference=T_world_reference, mode=how.drive, smooth=how.smooth
        )
        self._afresh = partial(_Solver, rig, layout, T_world_reference=T_world_reference, how=how)
        self._stabilise = Stabiliser(self._neutral[list(layout.head)], layout.head)
        self._fill = Filler(self._neutral)
        self._drive = self._for_performer(performer)
        self._layout = layout

    def __call__(self, frame: MarkerFrame) -> Pose:
        stabilised = self._stabilise(frame)
        seen = np.isfinite(stabilised.positions.sum(axis=1))
        return self._drive(self._fill(stabilised), seen)

    def with_performer(self, performer: Performer) -> _Solver:
        """The same with another calibration; what it remembers of the frames stays if the neutral does."""
        if not np.array_equal(neutral_in(self._layout, performer), self._neutral, equal_nan=True):
            return self._afresh(performer)
        self._drive = self._for_performer(performer)
        return self


def neutral_in(layout: MarkerLayout, performer: Performer) -> Array:
    """(M, 3) [m], ``head``: the performer's neutral in the order of `layout`; InputError where they share no marker."""
    row = {name: i for i, name in enumerate(performer.markers)}
    neutral = np.full((len(layout.names), 3), np.nan)
    for i, name in enumerate(layout.names):
        if name in row:
            neutral[i] = performer.neutral[row[name]]
    if np.isnan(neutral).all():
        raise InputError(
            f"The performer {performer.name} was calibrated with the layout {performer.layout}, which shares no marker "
            f"with {layout.name}; calibrate again, or run with --layout {performer.layout}."
        )
    return neutral


def poses(frames: Iterable[MarkerFrame], session: Session) -> Iterator[Pose]:
    """Every pose of a whole stream."""
    for frame in frames:
        yield from session(frame)
    yield from session.finish()
