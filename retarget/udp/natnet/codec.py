"""NatNet datagrams to values and back: no socket, no clock, no state.

A datagram is ``u16 id, u16 payload size, payload``, little-endian. The size field is telemetry, as clients fill it wrongly: the
length of the datagram counts. All input is hostile; whatever it holds, `decode` returns a value or raises `ProtocolError`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from retarget.udp.natnet.messages import Message
    from retarget.udp.natnet.version import Bitstream


def decode(datagram: bytes, version: Bitstream | None = None) -> Message:
    """Read one datagram.

    `version` is the bitstream of frames and model definitions, None as long as the server has not told it; every other message
    is the same in all versions. Raise `ProtocolError`, and nothing else, when the bytes do not follow the protocol.
    """
    raise NotImplementedError


def encode(message: Message, version: Bitstream | None = None) -> bytes:
    """Write one datagram; the inverse of `decode` for the same `version`.

    A frame or model definition of another version is converted: what `version` does not carry is left out, what it adds is
    zero. Raise `InputError` when the value does not fit: a number too large for its field, a name with a NUL, too many bytes.
    """
    raise NotImplementedError
