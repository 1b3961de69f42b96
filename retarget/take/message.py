"""How a datagram lies in a message of an MCAP take.

A message's data is a header, then the datagram's bytes as they were on the wire:

====== ====== ===========================================================================
offset type   meaning
====== ====== ===========================================================================
0      u8     version of this header, 1
1      u8     direction: 0 came in from the peer, 1 went out to it
2      u16    the peer's port
4      f64    local monotonic time of arrival or departure [s], bit for bit
12     u8     length n of the peer's address
13     text   the peer's address, n bytes of UTF-8
====== ====== ===========================================================================

All little-endian. The channel is the MCAP channel: `/natnet/command` or `/natnet/data`.
"""

from __future__ import annotations

import struct
from typing import Final, Literal

from retarget.errors import ProtocolError
from retarget.udp.datagram import Datagram

Channel = Literal["command", "data"]
TOPICS: Final[dict[Channel, str]] = {"command": "/natnet/command", "data": "/natnet/data"}
ENCODING: Final = "x-retarget-datagram"
LAYOUT: Final = "u8 version=1, u8 direction (0 in, 1 out), u16 port, f64 monotonic_s, u8 n, n bytes address, datagram"
VERSION: Final = 1

_HEADER: Final = struct.Struct("<BBHdB")
_WAYS: Final[tuple[Literal["in"], Literal["out"]]] = ("in", "out")


def pack(datagram: Datagram) -> bytes:
    """The message data of one datagram. Raises ValueError where the peer's address or port cannot be one."""
    address, port = datagram.peer
    text = address.encode()
    if len(text) > 255 or not 0 <= port <= 0xFFFF:
        raise ValueError(f"{address[:60]!r} port {port} is no address of a peer")
    way = 0 if datagram.direction == "in" else 1
    return _HEADER.pack(VERSION, way, port, datagram.received_s, len(text)) + text + datagram.payload


def unpack(data: bytes, channel: Channel) -> Datagram:
    """The datagram of one message's data. Raises ProtocolError where the header is not as above."""
    if len(data) < _HEADER.size:
        raise ProtocolError(f"A message of {len(data)} bytes is too short for a recorded datagram")
    version, way, port, received_s, n = _HEADER.unpack_from(data)
    end = _HEADER.size + n
    if version != VERSION or way > 1 or len(data) < end or received_s - received_s != 0.0:
        raise ProtocolError(f"A message does not start with the header of a recorded datagram, version {VERSION}")
    try:
        address = data[_HEADER.size : end].decode()
    except UnicodeDecodeError as error:
        raise ProtocolError("The address of a recorded datagram's peer is not text") from error
    return Datagram(received_s, _WAYS[way], channel, (address, port), data[end:])
