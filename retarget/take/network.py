"""UDP datagrams in link-layer packets, and back: Ethernet, Linux cooked, loopback, raw IP; IPv4 with its fragments.

Sources: RFC 791, 768, 1071 (checksum), 815 (fragments), and the LINKTYPE_ list of tcpdump.org.
"""

from __future__ import annotations

import struct
from collections import OrderedDict
from dataclasses import dataclass, field
from ipaddress import AddressValueError, IPv4Address
from typing import Final

from retarget.errors import OutputError

ETHERNET: Final = 1
MAX_UDP_PAYLOAD: Final = 65_507
MAX_OPEN_DATAGRAMS: Final = 64
"""Datagrams whose fragments are being gathered at a time; the oldest gives way."""
MAX_FRAGMENTS: Final = 128
"""Of one datagram: the largest needs 45 on Ethernet."""

_IPV4_TYPE: Final = 0x0800
_VLAN_TYPES: Final = (0x8100, 0x88A8)
_UDP_PROTOCOL: Final = 17
_HEADER_BYTES_AND_TYPE_AT: Final = {ETHERNET: (14, 12), 113: (16, 14), 276: (20, 0)}
_NULL_LOOPBACK: Final = (0, 108)
_RAW_IP: Final = (12, 14, 101, 228)
_ADDRESS_FAMILY_INET: Final = 2

Endpoint = tuple[str, int]


@dataclass(frozen=True, slots=True)
class UdpPacket:
    """One UDP datagram with both ends."""

    source: Endpoint
    destination: Endpoint
    payload: bytes


@dataclass(slots=True)
class _Gathering:
    """Fragments of one datagram by their offset."""

    parts: dict[int, bytes] = field(default_factory=dict)
    size: int | None = None
    """Known when the last fragment is there."""

    def add(self, offset: int, data: bytes, *, last: bool) -> bytes | None:
        """The whole, once it is there."""
        self.parts[offset] = data
        if last:
            self.size = offset + len(data)
        whole = bytearray()
        for start in sorted(self.parts):
            if start > len(whole):
                return None
            whole[start:] = self.parts[start]
        return bytes(whole) if self.size is not None and len(whole) >= self.size else None


class UdpExtractor:
    """Finds UDP datagrams in packets; holds the fragments of those that are not complete yet."""

    def __init__(self) -> None:
        self.others = 0
        """Packets that are no UDP over IPv4."""
        self.damaged = 0
        """UDP datagrams of which a part is missing or whose lengths contradict each other."""
        self._gathering: OrderedDict[bytes, _Gathering] = OrderedDict()

    @property
    def incomplete(self) -> int:
        """Fragmented datagrams that still lack a part."""
        return len(self._gathering)

    def __call__(self, link_type: int, data: bytes) -> UdpPacket | None:
        """The datagram that `data` holds or completes, else None."""
        packet = _ip_packet(link_type, data)
        if packet is None or len(packet) < 20 or packet[0] >> 4 != 4 or packet[9] != _UDP_PROTOCOL:
            self.others += 1
            return None
        header = (packet[0] & 0x0F) * 4
        total = int.from_bytes(packet[2:4], "big") or len(packet)  # 0 where the network card cuts large packets
        if header < 20 or not header <= total <= len(packet):
            self.damaged += 1
            return None
        body = self._whole(packet, packet[header:total])
        return None if body is None else self._udp(packet[12:16], packet[16:20], body)

    def _whole(self, packet: bytes, body: bytes) -> bytes | None:
        flags = int.from_bytes(packet[6:8], "big")
        more, offset = bool(flags & 0x2000), (flags & 0x1FFF) * 8
        if not more and offset == 0:
            return body
        key = packet[4:6] + packet[12:20]
        gathering = self._gathering.setdefault(key, _Gathering())
        whole = gathering.add(offset, body, last=not more)
        if whole is not None:
            del self._gathering[key]
        elif len(gathering.parts) > MAX_FRAGMENTS:
            del self._gathering[key]
            self.damaged += 1
        elif len(self._gathering) > MAX_OPEN_DATAGRAMS:
            self._gathering.popitem(last=False)
            self.damaged += 1
        return whole

    def _udp(self, source: bytes, destination: bytes, body: bytes) -> UdpPacket | None:
        if len(body) < 8:
            self.damaged += 1
            return None
        source_port, destination_port, length, _ = struct.unpack_from(">HHHH", body)
        if not 8 <= length <= len(body):
            self.damaged += 1
            return None
        ends = (str(IPv4Address(source)), source_port), (str(IPv4Address(destination)), destination_port)
        return UdpPacket(*ends, body[8:length])


def ethernet_frame(packet: UdpPacket, identification: int) -> bytes:
    """An Ethernet frame that carries `packet`, checksums right; one frame whatever its size, as on a loopback.

    Raises OutputError for addresses that are not IPv4 and payloads beyond `MAX_UDP_PAYLOAD`.
    """
    source, destination = _address(packet.source[0]), _address(packet.destination[0])
    if len(packet.payload) > MAX_UDP_PAYLOAD:
        raise OutputError(f"A datagram of {len(packet.payload)} bytes does not fit into UDP")
    length = 8 + len(packet.payload)
    ports = struct.pack(">HHH", packet.source[1], packet.destination[1], length)
    pseudo = source + destination + struct.pack(">BBH", 0, _UDP_PROTOCOL, length)
    udp_sum = _checksum(pseudo + ports + b"\0\0" + packet.payload) or 0xFFFF
    start = struct.pack(">BBHHHBB", 0x45, 0, 20 + length, identification & 0xFFFF, 0x4000, 64, _UDP_PROTOCOL)
    ip_sum = _checksum(start + b"\0\0" + source + destination)
    ip = start + struct.pack(">H", ip_sum) + source + destination
    ethernet = _mac(destination) + _mac(source) + struct.pack(">H", _IPV4_TYPE)
    return ethernet + ip + ports + struct.pack(">H", udp_sum) + packet.payload


def _ip_packet(link_type: int, data: bytes) -> bytes | None:
    if link_type in _RAW_IP:
        return data
    if link_type in _NULL_LOOPBACK:
        family = data[:4]
        return data[4:] if _ADDRESS_FAMILY_INET.to_bytes(4, "big") in (family, family[::-1]) else None
    if link_type not in _HEADER_BYTES_AND_TYPE_AT:
        return None
    header, at = _HEADER_BYTES_AND_TYPE_AT[link_type]
    kind = int.from_bytes(data[at : at + 2], "big")
    while kind in _VLAN_TYPES and len(data) >= header + 4:
        kind = int.from_bytes(data[header + 2 : header + 4], "big")
        header += 4
    return data[header:] if kind == _IPV4_TYPE else None


def _address(text: str) -> bytes:
    try:
        return IPv4Address(text).packed
    except AddressValueError as error:
        raise OutputError(f"{text[:60]!r} is no IPv4 address, and a capture of NatNet needs one") from error


def _mac(address: bytes) -> bytes:
    """A locally administered address made of the IPv4 address, or the multicast address belonging to it (RFC 1112)."""
    if 224 <= address[0] < 240:
        return b"\x01\x00\x5e" + bytes([address[1] & 0x7F]) + address[2:]
    return b"\x02\x00" + address


def _checksum(data: bytes) -> int:
    """Ones' complement of the ones' complement sum of big-endian 16-bit words (RFC 1071)."""
    total = (
        int.from_bytes(data + bytes(len(data) % 2), "big") % 0xFFFF
    )  # 2^16 is 1 modulo 2^16 - 1, so the words add up
    return 0xFFFF - total
