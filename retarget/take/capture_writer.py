"""Takes as pcapng, for Wireshark and its relatives: the datagrams with network headers made up around them.

A take knows the peer of each datagram but not our own address, so a stand-in is written: the loopback for loopback
peers, else 192.0.2.1, an address reserved for documentation (RFC 5737). Interface names tell the channel and packet
flags the direction, so that a capture of ours reads back as the same take. Times are kept to the nanosecond.
"""

from __future__ import annotations

import json
import struct
from typing import TYPE_CHECKING, Final

from retarget.take import packets
from retarget.take.capture import INTERFACES, METADATA_KEY
from retarget.take.metadata import TakeMetadata, wall_ns
from retarget.take.network import ETHERNET, Endpoint, UdpPacket, ethernet_frame

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from retarget.take.message import Channel
    from retarget.udp.datagram import Datagram

_BYTE_ORDER_MAGIC: Final = 0x1A2B3C4D
_LOCAL_PORTS: Final[dict[Channel, int]] = {"command": 51510, "data": 1511}
_FLAGS: Final = {"in": 1, "out": 2}
_NANOSECONDS: Final = bytes([9])


def write_capture(path: Path, datagrams: Iterable[Datagram], metadata: TakeMetadata) -> int:
    """Write a pcapng file and return the number of datagrams.

    Raises OutputError where a peer's address is not IPv4, OSError where the file cannot be written.
    """
    metadata = metadata.with_clock_offset()
    offset = metadata.clock_offset_ns or 0
    numbers = {channel: number for number, channel in enumerate(INTERFACES)}
    count = 0
    with path.open("wb") as file:
        file.write(_section(metadata))
        for name in INTERFACES.values():
            file.write(_interface(name))
        for datagram in datagrams:
            frame = ethernet_frame(_addressed(datagram), identification=count)
            stamp = wall_ns(datagram.received_s, offset)
            file.write(_packet(numbers[datagram.channel], stamp, frame, _FLAGS[datagram.direction]))
            count += 1
    return count


def _section(metadata: TakeMetadata) -> bytes:
    comment = json.dumps({METADATA_KEY: metadata.as_text_map()}).encode()[:0xFFFF]
    fixed = struct.pack("<IHHq", _BYTE_ORDER_MAGIC, 1, 0, -1)
    return _block(packets.SECTION, fixed + _options((packets.OPT_COMMENT, comment)))


def _interface(name: str) -> bytes:
    fixed = struct.pack("<HHI", ETHERNET, 0, 0)
    options = _options((packets.OPT_IF_NAME, name.encode()), (packets.OPT_TSRESOL, _NANOSECONDS))
    return _block(packets.INTERFACE, fixed + options)


def _packet(interface: int, stamp_ns: int, frame: bytes, flags: int) -> bytes:
    fixed = struct.pack("<IIIII", interface, stamp_ns >> 32, stamp_ns & 0xFFFF_FFFF, len(frame), len(frame))
    options = _options((packets.OPT_FLAGS, struct.pack("<I", flags)))
    return _block(packets.ENHANCED_PACKET, fixed + _padded(frame) + options)


def _addressed(datagram: Datagram) -> UdpPacket:
    address = "127.0.0.1" if datagram.peer[0].startswith("127.") else "192.0.2.1"
    local: Endpoint = (address, _LOCAL_PORTS[datagram.channel])
    ends = (datagram.peer, local) if datagram.direction == "in" else (local, datagram.peer)
    return UdpPacket(*ends, datagram.payload)


def _block(kind: int, body: bytes) -> bytes:
    length = struct.pack("<I", len(body) + 12)
    return struct.pack("<I", kind) + length + body + length


def _options(*options: tuple[int, bytes]) -> bytes:
    return b"".join(struct.pack("<HH", code, len(value)) + _padded(value) for code, value in options) + bytes(4)


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)
