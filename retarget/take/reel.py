"""A take as what a server plays: any frame at any time, in any bitstream, while only its times are in memory."""

from __future__ import annotations

import logging
import sys
import threading
from array import array
from bisect import bisect_left
from typing import TYPE_CHECKING, Final

import numpy as np

from retarget.errors import ProtocolError
from retarget.take.conversation import find_conversation
from retarget.take.decode import note_sent, rate_of_steps, shortest_float32
from retarget.udp.natnet.codec import decode
from retarget.udp.natnet.framedata import FrameOfData
from retarget.udp.natnet.messages import MessageId
from retarget.udp.natnet.models import ModelDef
from retarget.udp.natnet.version import Bitstream

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from retarget.take.reader import Take
    from retarget.udp.datagram import Datagram

_FRAME: Final = int(MessageId.FRAMEOFDATA).to_bytes(2, "little")
_MODELS: Final = int(MessageId.MODELDEF).to_bytes(2, "little")
_READ_ON: Final = 500
"""Frames that are read over rather than sought past."""

log = logging.getLogger("retarget.take")


class TakeReel:
    """The frames of a take's server as they were sent; of the model definitions the last that it told.

    A frame that cannot be read is played without markers. May be used from several threads. Raises InputError where the
    take holds no frames of marker data.
    """

    def __init__(self, take: Take) -> None:
        self._take = take
        self._conversation = find_conversation(take)
        self._definitions = ModelDef()
        self._received = array("d")
        self._bitstreams = array("H")  # major and minor, a byte each
        self._lock = threading.Lock()
        self._ahead: Iterator[bytes] = iter(())
        self._next = sys.maxsize  # the frame that `_ahead` gives next; nothing yet
        self._rate_hz = self._scan()
        self._times_s = np.maximum.accumulate(np.array(self._received))
        self._in_order = bool((np.diff(np.array(self._received)) >= 0).all())

    @property
    def definitions(self) -> ModelDef:
        """Names of the markers."""
        return self._definitions

    @property
    def rate_hz(self) -> float:
        """What the server said, else from the times of reception."""
        return self._rate_hz

    @property
    def times_s(self) -> NDArray[np.float64]:
        """(N,) when each frame was received [s]."""
        return self._times_s

    def frame(self, index: int) -> FrameOfData:
        """Frame at `index`, 0 to N - 1."""
        packed = self._bitstreams[index]
        with self._lock:
            payload = self._payload(index)
        number = int.from_bytes(payload[4:8], "little", signed=True)
        for version in dict.fromkeys((Bitstream(packed >> 8, packed & 0xFF), self._conversation.wanted)):
            try:
                message = decode(payload, version)
            except ProtocolError as error:
                log.debug("Frame %d cannot be read as %s: %s", number, version, error)
                continue
            if isinstance(message, FrameOfData):
                return message
        return FrameOfData(number)

    def _scan(self) -> float:
        """Note the times and bitstreams of all frames, and the definitions; returns the frame rate [Hz]."""
        session = self._conversation.session(self._take)
        for told in self._conversation.told_first:
            self._note_definitions(told, session.bitstream)
        for datagram in self._conversation.datagrams(self._take):
            if datagram.direction == "out":
                note_sent(session, datagram)
            elif datagram.payload.startswith(_FRAME):
                version = session.bitstream or Bitstream(0, 0)
                self._received.append(datagram.received_s)
                self._bitstreams.append(version.major << 8 | version.minor)
            else:
                session.receive(datagram.payload, datagram.received_s)
                self._note_definitions(datagram, session.bitstream)
        if session.rate_hz is not None:
            return shortest_float32(session.rate_hz)
        return rate_of_steps(np.diff(np.array(self._received))) or 1.0

    def _note_definitions(self, datagram: Datagram, version: Bitstream | None) -> None:
        if not datagram.payload.startswith(_MODELS):
            return
        try:
            message = decode(datagram.payload, version)
        except ProtocolError as error:
            log.warning("%s: model definitions cannot be read: %s", self._take.path, error)
            return
        if isinstance(message, ModelDef):
            self._definitions = message

    def _payload(self, index: int) -> bytes:
        if not self._next <= index <= self._next + _READ_ON:
            self._seek(index)
        for payload in self._ahead:
            self._next += 1
            if self._next > index:
                return payload
        return b""

    def _seek(self, index: int) -> None:
        """Have the frame at `index`, or one shortly before it, come next."""
        time_s = self._received[index] if self._in_order else self._take.start_s
        self._next = bisect_left(self._received, time_s) if self._in_order else 0
        datagrams = self._take.datagrams_from(time_s) if self._in_order else iter(self._take)
        server = self._conversation.server
        self._ahead = (
            datagram.payload
            for datagram in datagrams
            if datagram.direction == "in" and datagram.peer[0] == server and datagram.payload.startswith(_FRAME)
        )
