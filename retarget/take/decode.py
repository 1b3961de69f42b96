"""Marker frames out of takes: the recorded datagrams of both directions go through the decoder of live streams.

The same take gives the same frames, bit for bit, every time. Positions in metres, in the server's own axes; times are
those of the recorder's monotonic clock.
"""

from __future__ import annotations

import logging
from itertools import islice, pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from retarget.errors import InputError, ProtocolError
from retarget.frames import MarkerLayout
from retarget.markers.clip import MarkerClip
from retarget.take.conversation import find_conversation

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame
    from retarget.take.reader import Take
    from retarget.udp.datagram import Datagram
    from retarget.udp.natnet.session import NatNetSession

_MOST_TIMES_LONGER: Final = 20
"""A gap in the frame numbers becomes a gap in the clip unless that makes the take so many times longer."""
_FRAMES_FOR_RATE: Final = 240

log = logging.getLogger("retarget.take")


class TakeFrames:
    """The marker frames of `take`. Every iteration starts anew; `session` tells about the latest.

    Raises InputError where the take holds no frame that can be read.
    """

    def __init__(self, take: Take) -> None:
        self.take = take
        self._conversation = find_conversation(take)
        self.session: NatNetSession = self._conversation.session(take)
        """The decoder: server, bitstream, and counts of what was lost, doubled and malformed."""
        self._others: set[str] = set()
        trial = self._conversation.session(take)
        first = list(islice(self._decoded(trial), _FRAMES_FOR_RATE))
        self.rate_hz = _rate_hz(trial, first)
        """Frames a second, as the server said, else as its first time stamps say; None where neither tells."""

    def __iter__(self) -> Iterator[MarkerFrame]:
        self.session = self._conversation.session(self.take)
        return self._decoded(self.session)

    def _decoded(self, session: NatNetSession) -> Iterator[MarkerFrame]:
        for datagram in self.take:
            if datagram.peer[0] != self._conversation.server:
                self._note_other(datagram)
            elif datagram.direction == "out":
                note_sent(session, datagram)
            elif (frame := session.receive(datagram.payload, datagram.received_s)) is not None:
                yield frame
        if not session.framing.delivered:
            raise InputError(f"{self.take.path}: none of its frames can be read as bitstream {session.bitstream}")

    def _note_other(self, datagram: Datagram) -> None:
        """Say once of every other server that it is not read."""
        server = datagram.peer[0]
        if datagram.channel == "data" and server not in self._others:
            self._others.add(server)
            log.warning(
                "%s: the frames of %s are read, those of %s not", self.take.path, self._conversation.server, server
            )


def frames(take: Take) -> Iterator[MarkerFrame]:
    """The marker frames of `take`, as `TakeFrames`."""
    return iter(TakeFrames(take))


def clip_of(take: Take) -> MarkerClip:
    """All marker frames of `take`, with unseen markers where frames were lost.

    Raises InputError where there is none, or none with a named marker.
    """
    source = TakeFrames(take)
    found = list(source)
    names = tuple(dict.fromkeys(name for frame in found for name in frame.layout.names))
    if not names:
        raise InputError(
            f"{take.path}: no marker in it has a name; switch on labelled markers in the sender's settings"
        )
    if source.rate_hz is None:
        raise InputError(f"{take.path} is too short to tell how many frames a second it has")
    rows, notes = _rows([frame.number for frame in found])
    positions = np.full((rows[-1] + 1, len(names), 3), np.nan)
    column = {name: i for i, name in enumerate(names)}
    for row, frame in zip(rows, found, strict=True):
        positions[row, [column[name] for name in frame.layout.names]] = frame.positions
    loose = sum(frame.unlabelled is not None and len(frame.unlabelled) > 0 for frame in found)
    if loose:
        notes = (*notes, f"{loose} frames hold points without a name; these are left out.")
    return MarkerClip(
        layout=MarkerLayout(take.path.stem, names),
        rate_hz=source.rate_hz,
        positions=positions,
        source=take.path,
        first_frame=found[0].number,
        notes=notes,
    )


def note_sent(session: NatNetSession, datagram: Datagram) -> None:
    """Let the decoder know of a recorded datagram that the client sent; answers refer to it."""
    try:
        session.sent(datagram.payload, datagram.received_s)
    except ProtocolError:
        log.debug("A datagram that was sent does not follow the protocol")


def _rows(numbers: Sequence[int]) -> tuple[list[int], tuple[str, ...]]:
    """(row of each frame, what had to be decided)."""
    span = numbers[-1] - numbers[0] + 1
    rising = all(a < b for a, b in pairwise(numbers))
    if not rising or span > _MOST_TIMES_LONGER * len(numbers):
        return list(range(len(numbers))), ("The frame numbers jump; the frames are taken one after another.",)
    lost = span - len(numbers)
    notes = (f"{lost} frames were lost; nothing is seen in them.",) if lost else ()
    return [number - numbers[0] for number in numbers], notes


def _rate_hz(session: NatNetSession, found: Sequence[MarkerFrame]) -> float | None:
    if session.rate_hz is not None:
        return shortest_float32(session.rate_hz)
    pairs = [(a, b) for a, b in pairwise(found) if b.number > a.number]
    return rate_of_steps(np.array([(b.time_s - a.time_s) / (b.number - a.number) for a, b in pairs]))


def rate_of_steps(steps_s: NDArray[np.float64]) -> float | None:
    """Frames a second of the usual step [Hz], to a hundredth; None where there is no step."""
    steps = steps_s[steps_s > 0]
    return max(0.01, round(float(1 / np.median(steps)), 2)) if len(steps) else None


def shortest_float32(value: float) -> float:
    """The shortest decimal number that stands for the same float32: 59.94, not 59.939998626708984."""
    return float(str(np.float32(value)))
