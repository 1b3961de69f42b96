"""A performer led through a calibration, live: each expression is asked for, seen or asked for again.

Everything that comes between the first prompt and the last is kept, so what is calibrated is what was shown; the frames
of a prompt carry its name, and only they are searched for its expression.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from calib.expressions import EXPRESSIONS
from calib.eye import Eye, SeenNeutral
from calib.live_frames import LiveFrames
from calib.material import Material, RangeTake
from calib.neutral import find_neutral
from calib.recording import gather, recording_of
from calib.talk import TerminalTalk
from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from calib.expressions import Expression
    from calib.recording import Recording
    from calib.talk import Talk
    from retarget.frames import MarkerFrame
    from retarget.markers.layouts import Layout
    from retarget.rig.model import Rig

TRIES = 3
"""After that the guide goes on without."""
NEUTRAL_S = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class _Prompted:
    """The frames in which something was asked for."""

    name: str
    recording: Recording


def guided_material(where: str, rig: Rig, layout: Layout | None, record: str | None, seconds: float) -> Material:
    """What a performer shows to the live source `where`, prompted on the terminal; kept in the take `record` too."""
    from retarget.sources import open_source
    from retarget.take.metadata import TakeMetadata
    from retarget.take.recorder import TakeRecorder

    talk = TerminalTalk()
    with ExitStack() as stack:
        tap = None
        if record:
            if Path(record).suffix.lower() != ".mcap":
                raise InputError(f"{record} must end in .mcap: a live stream is recorded as it comes.")
            tap = stack.enter_context(TakeRecorder(Path(record), TakeMetadata(source=where, rig=rig.name)))
        source = open_source(where, tap=tap)
        if not source.live:
            raise InputError(f"{where} is no live source; give takes with --rom.")
        live = stack.enter_context(LiveFrames(source))
        return Guide(live, rig, layout, talk, seconds).lead()


class Guide:
    """Leads one performer through the neutral and every expression that the rig can show."""

    def __init__(self, live: LiveFrames, rig: Rig, layout: Layout | None, talk: Talk, seconds: float) -> None:
        """Each prompt lasts `seconds` [s]."""
        self._live, self._rig, self._layout, self._talk, self._seconds = live, rig, layout, talk, seconds

    def lead(self) -> Material:
        """The neutral and all prompted frames; InputError where the neutral is never still, or nothing was shown."""
        neutral = self._neutral()
        eye = Eye(self._rig, neutral)
        shown = [e for e in EXPRESSIONS if e.name in eye.names]
        prompted: list[_Prompted] = []
        for number, expression in enumerate(shown, 1):
            prompted += self._expression(f"{number} of {len(shown)}", expression, eye)
        if not prompted:
            raise InputError("Nothing was shown, so there is nothing to calibrate with.")
        return Material(neutral.still, (_one_take(prompted, neutral.recording),))

    def _neutral(self) -> SeenNeutral:
        for left in range(TRIES - 1, -1, -1):
            self._talk.ask("Rest your face and look straight ahead; Enter starts. ")
            recording = self._recording("neutral", self._live.gather(NEUTRAL_S, self._talk.show))
            try:
                still = find_neutral(recording)
            except InputError as error:
                if not left:
                    raise
                self._talk.say(f"{error} Once more.")
            else:
                self._talk.say(f"Seen: a still face, within {1e3 * still.spread_m:.2f} mm over {still.frames} frames.")
                return SeenNeutral(still, recording)
        raise InputError("The face was never still.")

    def _expression(self, which: str, expression: Expression, eye: Eye) -> list[_Prompted]:
        """The frames of every try, one of which may show nothing; none where it was skipped."""
        tries: list[_Prompted] = []
        for left in range(TRIES - 1, -1, -1):
            answer = self._talk.ask(
                f"{which}: {expression.ask}, two or three times in {self._seconds:.0f} s; Enter starts, s skips. "
            )
            if answer.strip().lower().startswith("s"):
                return tries
            frames = self._live.gather(self._seconds, self._talk.show)
            tries.append(_Prompted(expression.name, self._recording(expression.name, frames)))
            seen, words = eye.sees(tries[-1].recording, expression.name)
            self._talk.say(words)
            if seen:
                return tries
            self._talk.say("Again, a little more." if left else "It goes on without.")
        return tries

    def _recording(self, name: str, frames: Sequence[MarkerFrame]) -> Recording:
        return gather(name, frames, self._layout)


def _one_take(prompted: Sequence[_Prompted], neutral: Recording) -> RangeTake:
    """All prompted frames as one take, in the order in which they came."""
    times = np.concatenate([p.recording.times for p in prompted])
    world = np.concatenate([p.recording.world for p in prompted])
    prompts = tuple(p.name for p in prompted for _ in p.recording.times)
    return RangeTake(recording_of("the guided take", neutral.layout, times, world), None, prompts)
