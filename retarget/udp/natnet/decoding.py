"""Reading the datagrams of one server, whose bitstream is known only as far as it tells.

Servers answer CONNECT with the version that they speak, not always with the one that they send after they were asked
for another. So the version asked for and the one announced are tried where the other does not fit; from 4.1 the sizes
of a frame's sections tell reliably which it is.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from retarget.errors import ProtocolError
from retarget.udp.natnet.codec import decode
from retarget.udp.natnet.framedata import FrameOfData
from retarget.udp.natnet.messages import MessageId

if TYPE_CHECKING:
    from retarget.udp.natnet.messages import Message
    from retarget.udp.natnet.version import Bitstream

FAILURES_IN_A_ROW = 5
"""Frames that cannot be read, one after another, before the server is asked what it sends."""

_log = logging.getLogger("retarget.natnet")


class Decoding:
    """Reads datagrams; what does not follow the protocol is counted."""

    def __init__(self, peer: str, wanted: Bitstream | None) -> None:
        self._peer = peer
        self._wanted = wanted
        self._failures_in_a_row = 0
        self.announced: Bitstream | None = None
        """What the server said it sends."""
        self.bitstream: Bitstream | None = None
        """What frames are read in; None as long as nothing is known."""
        self.malformed = 0
        """Datagrams that do not follow the protocol."""

    def read(self, datagram: bytes) -> Message | None:
        """Read one; None when it cannot be read."""
        try:
            message = self._decode(datagram)
        except ProtocolError as error:
            self._count(datagram, error)
            return None
        if isinstance(message, FrameOfData):
            self._failures_in_a_row = 0
        return message

    def lost_track(self) -> bool:
        """Whether just now so many frames in a row could not be read that something changed."""
        if self._failures_in_a_row < FAILURES_IN_A_ROW:
            return False
        self._failures_in_a_row = 0
        return True

    def _decode(self, datagram: bytes) -> Message:
        try:
            return decode(datagram, self.bitstream)
        except ProtocolError as error:
            return self._decode_otherwise(datagram, error)

    def _decode_otherwise(self, datagram: bytes, error: ProtocolError) -> Message:
        for version in {self._wanted, self.announced} - {None, self.bitstream}:
            try:
                message = decode(datagram, version)
            except ProtocolError:
                continue
            _log.info("%s sends bitstream %s.", self._peer, version)
            self.bitstream = version
            return message
        raise error

    def _count(self, datagram: bytes, error: ProtocolError) -> None:
        self.malformed += 1
        _log.debug("A datagram of %d bytes from %s is skipped: %s", len(datagram), self._peer, error)
        if int.from_bytes(datagram[:2], "little") == MessageId.FRAMEOFDATA and self.bitstream is not None:
            self._failures_in_a_row += 1
            if self._failures_in_a_row == FAILURES_IN_A_ROW:
                _log.warning("%s sends frames that are not of bitstream %s: %s", self._peer, self.bitstream, error)
