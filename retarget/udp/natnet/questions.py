"""What a client asks once it is connected: one question at a time, as answers do not say what they answer.

An answer that comes too late would be taken for that to the next question; so after a question that was not answered in
time, everything that comes for a while is ignored before the next one is put.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from retarget.errors import ProtocolError
from retarget.udp.natnet.messages import Request, Response
from retarget.udp.natnet.version import Bitstream, parse_bitstream

if TYPE_CHECKING:
    from collections.abc import Iterable

BITSTREAM = "Bitstream"
FRAME_RATE = "FrameRate"
MILLIMETRES = "UnitsToMillimeters"

_PATIENCE_S = 0.4
_QUIET_S = 0.3


@dataclass(slots=True)
class Answers:
    """What the server said; None where it did not, or nothing that can be."""

    bitstream: Bitstream | None = None
    rate_hz: float | None = None
    millimetres: float | None = None
    """Length of the server's unit [mm]."""

    def take(self, command: str, response: Response) -> None:
        """Read the answer to `command`; one that makes no sense is no answer."""
        if command == BITSTREAM:
            self.bitstream = _bitstream(response)
        elif command == FRAME_RATE:
            self.rate_hz = _number(response, 1e-3, 1e5)
        elif command == MILLIMETRES:
            self.millimetres = _number(response, 1e-3, 1e6)


class Questions:
    """A list of questions and the answers to them. Without a clock: times are told [s]."""

    def __init__(self) -> None:
        self._open: deque[str] = deque()
        self._asked: str | None = None
        self._until_s = -math.inf  # answers are awaited, or ignored, until then
        self.answers = Answers()

    @property
    def settled(self) -> bool:
        """Whether every question was answered or given up."""
        return not self._open and self._asked is None

    @property
    def next_s(self) -> float:
        """When there is something to do again."""
        return math.inf if self.settled else self._until_s

    def begin(self, commands: Iterable[str]) -> None:
        """Forget what was answered and ask these."""
        self._open = deque(commands)
        self._asked = None
        self.answers = Answers()

    def due(self, now_s: float) -> Request | None:
        """The question that is to be put now."""
        if now_s < self._until_s:
            return None
        if self._asked is not None:
            self._asked = None
            self._until_s = now_s + _QUIET_S
            return None
        return Request.of(self._open[0]) if self._open else None

    def put(self, command: str, sent_s: float) -> None:
        """A question has left; questions of others that share the connection are answered too."""
        if self._open and self._open[0] == command:
            self._open.popleft()
        self._asked = command
        self._until_s = sent_s + _PATIENCE_S

    def answered(self, response: Response | None) -> None:
        """An answer came; None is the answer that the question is not known."""
        if self._asked is None:
            return
        if response is not None:
            self.answers.take(self._asked, response)
        self._asked = None
        self._until_s = -math.inf


def _bitstream(response: Response) -> Bitstream | None:
    """Read ``Bitstream,4.1``; some servers leave the word out."""
    try:
        return parse_bitstream(response.text.rpartition(",")[2])
    except ProtocolError:
        return None


def _number(response: Response, least: float, most: float) -> float | None:
    value = response.float32
    return value if value is not None and least <= value <= most else None
