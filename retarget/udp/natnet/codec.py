"""NatNet datagrams to values and back: no socket, no clock, no state.

A datagram is ``u16 id, u16 payload size, payload``, little-endian. The size field is telemetry, as clients fill it
wrongly: the length of the datagram counts. All input is hostile; whatever it holds, `decode` returns a value or raises
`ProtocolError`.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from retarget.errors import InputError, ProtocolError
from retarget.udp.natnet.command_codec import READERS, WRITERS
from retarget.udp.natnet.frame_reading import read_frame
from retarget.udp.natnet.frame_writing import write_frame
from retarget.udp.natnet.framedata import FrameOfData
from retarget.udp.natnet.messages import MessageId, Unknown
from retarget.udp.natnet.model_reading import read_model_def
from retarget.udp.natnet.model_writing import write_model_def
from retarget.udp.natnet.models import ModelDef
from retarget.udp.natnet.reader import Cursor
from retarget.udp.natnet.version import layout_of
from retarget.udp.natnet.writer import Writer

if TYPE_CHECKING:
    from retarget.udp.natnet.messages import Message
    from retarget.udp.natnet.version import Bitstream, BitstreamLayout

HEADER = struct.Struct("<HH")
MAX_PAYLOAD = 65503
"""A UDP datagram over IPv4 carries 65,507 bytes."""

_FRAMEOFDATA = int(MessageId.FRAMEOFDATA)
_MODELDEF = int(MessageId.MODELDEF)


def decode(datagram: bytes, version: Bitstream | None = None) -> Message:
    """Read one datagram.

    `version` is the bitstream of frames and model definitions, None as long as the server has not told it; every other
    message is the same in all versions. Raise `ProtocolError`, and nothing else, when the bytes do not follow the
    protocol. A message whose id is not known is an `Unknown`, not an error.
    """
    if len(datagram) < HEADER.size:
        raise ProtocolError(
            f"{len(datagram)} bytes are too few for a NatNet datagram, which starts with {HEADER.size}."
        )
    cursor = Cursor(bytes(datagram), HEADER.size)
    kind, _ = HEADER.unpack_from(datagram)
    if kind == _FRAMEOFDATA:
        return read_frame(cursor, _layout(version))
    if kind == _MODELDEF:
        return read_model_def(cursor, _layout(version))
    read = READERS.get(kind)
    return Unknown(kind, cursor.rest()) if read is None else read(cursor)


def encode(message: Message, version: Bitstream | None = None) -> bytes:
    """Write one datagram; the inverse of `decode` for the same `version`.

    A frame or model definition of another version is converted: what `version` does not carry is left out, what it adds
    is zero. Raise `InputError` when the value does not fit: a number too large for its field, a name with a NUL, too
    many bytes; and `ProtocolError` when there is no such `version`.
    """
    out = Writer()
    kind = _write_payload(out, message, version)
    payload = out.getvalue()
    if len(payload) > MAX_PAYLOAD:
        raise InputError(
            f"A message of {len(payload)} bytes is too long for a datagram, which carries {MAX_PAYLOAD}; "
            "send fewer markers."
        )
    header = Writer()
    header.pack(HEADER, kind, len(payload))
    return header.getvalue() + payload


def _write_payload(out: Writer, message: Message, version: Bitstream | None) -> int:
    """Write what follows the header; return the message's id."""
    if isinstance(message, FrameOfData):
        write_frame(out, message, _layout(version))
        return _FRAMEOFDATA
    if isinstance(message, ModelDef):
        write_model_def(out, message, _layout(version))
        return _MODELDEF
    if isinstance(message, Unknown):
        out.octets(message.payload)
        return message.id
    kind, write = WRITERS[type(message)]
    write(out, message)
    return int(kind)


def _layout(version: Bitstream | None) -> BitstreamLayout:
    if version is None:
        raise ProtocolError(
            "The bitstream version of a frame is not known before the server has told it; connect first."
        )
    return layout_of(version)
