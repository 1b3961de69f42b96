"""Packets out of captures: pcapng and classic pcap, both byte orders, every time resolution.

Input is hostile: every length is checked against what is left of the file, and a file that ends within a block gives
what stood before it. Layouts: draft-ietf-opsawg-pcapng and draft-ietf-opsawg-pcap.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, BinaryIO, Final

from retarget.errors import ProtocolError

if TYPE_CHECKING:
    from collections.abc import Iterator

SECTION, INTERFACE, OLD_PACKET, SIMPLE_PACKET, ENHANCED_PACKET = 0x0A0D0D0A, 1, 2, 3, 6
OPT_COMMENT, OPT_IF_NAME, OPT_FLAGS, OPT_TSRESOL, OPT_TSOFFSET = 1, 2, 2, 9, 14
MAX_BLOCK_BYTES: Final = 16 * 1024 * 1024
MAX_INTERFACES: Final = 1024

_BYTE_ORDERS: Final = {b"\x1a\x2b\x3c\x4d": ">", b"\x4d\x3c\x2b\x1a": "<"}
_PCAP_MAGICS: Final = {
    b"\xa1\xb2\xc3\xd4": (">", 1000),
    b"\xd4\xc3\xb2\xa1": ("<", 1000),
    b"\xa1\xb2\x3c\x4d": (">", 1),
    b"\x4d\x3c\xb2\xa1": ("<", 1),
}
PCAPNG_MAGIC: Final = SECTION.to_bytes(4, "big")


@dataclass(frozen=True, slots=True)
class Packet:
    """One captured packet with its link-layer header."""

    time_ns: int
    """Unix epoch [ns]."""
    link_type: int
    """LINKTYPE_ number: 1 Ethernet, 101 raw IP, 113 Linux cooked ..."""
    interface: str
    """Name of the interface, "" where the file does not say."""
    data: bytes
    whole: bool
    """False where the capture kept only the packet's beginning."""
    flags: int = 0
    """The lowest two bits: 1 came in, 2 went out, 0 not known."""


@dataclass(slots=True)
class CaptureNotes:
    """What a reader met besides packets."""

    comment: str = ""
    """Comment of the first section."""
    without_time: int = 0
    """Packets that the file gives no time for."""
    cut: bool = False
    """The file ends in the middle of a block, or a block makes no sense."""


@dataclass(frozen=True, slots=True)
class _Interface:
    link_type: int
    name: str
    ticks: tuple[int, int]
    """Nanoseconds of a tick as a fraction."""
    offset_ns: int


@dataclass(slots=True)
class _Section:
    order: str
    interfaces: list[_Interface] = field(default_factory=list)


def is_capture(start: bytes) -> bool:
    """Whether a file that starts so is a capture."""
    return start[:4] == PCAPNG_MAGIC or start[:4] in _PCAP_MAGICS


def read_packets(file: BinaryIO, notes: CaptureNotes) -> Iterator[Packet]:
    """Every packet of a capture; `notes` is filled meanwhile."""
    start = file.read(4)
    file.seek(0)
    packets = _pcap(file, *_PCAP_MAGICS[start]) if start in _PCAP_MAGICS else _pcapng(file, notes)
    try:
        yield from packets
    except ProtocolError:
        notes.cut = True


def _pcap(file: BinaryIO, order: str, tick_ns: int) -> Iterator[Packet]:
    head = file.read(24)
    if len(head) < 24:
        raise ProtocolError("The file's head is cut")
    link_type = int(struct.unpack_from(order + "I", head, 20)[0]) & 0x0FFF_FFFF
    fields = struct.Struct(order + "IIII")
    while record := file.read(fields.size):
        if len(record) < fields.size:
            raise ProtocolError("A record's head is cut")
        seconds, fraction, kept, original = fields.unpack(record)
        data = _exactly(file, kept)
        yield Packet(seconds * 10**9 + fraction * tick_ns, link_type, "", data, whole=kept >= original)


def _pcapng(file: BinaryIO, notes: CaptureNotes) -> Iterator[Packet]:
    section: _Section | None = None
    while head := file.read(8):
        if len(head) < 8:
            raise ProtocolError("A block's head is cut")
        if head[:4] == PCAPNG_MAGIC:
            section, comment = _section(file, head)
            notes.comment = notes.comment or comment
            continue
        if section is None:
            raise ProtocolError("The file does not begin with a section")
        kind, length = struct.unpack(section.order + "II", head)
        body = _body(file, length)
        if kind == INTERFACE:
            section.interfaces.append(_interface(body, section))
        elif kind in (ENHANCED_PACKET, OLD_PACKET):
            yield _packet(body, section, kind)
        elif kind == SIMPLE_PACKET:
            notes.without_time += 1


def _exactly(file: BinaryIO, count: int) -> bytes:
    if count > MAX_BLOCK_BYTES:
        raise ProtocolError(f"A block claims {count} bytes, more than {MAX_BLOCK_BYTES}")
    data = file.read(count)
    if len(data) < count:
        raise ProtocolError("A block is cut")
    return data


def _body(file: BinaryIO, length: int) -> bytes:
    """A block's body; its total length counts the eight bytes before and the four after it."""
    if length < 12 or length % 4:
        raise ProtocolError(f"A block cannot be {length} bytes long")
    return _exactly(file, length - 8)[:-4]


def _section(file: BinaryIO, head: bytes) -> tuple[_Section, str]:
    order = _BYTE_ORDERS.get(magic := file.read(4))
    if order is None:
        raise ProtocolError(f"A section's byte order {magic.hex()} is unknown")
    length = struct.unpack(order + "I", head[4:])[0]
    body = magic + _body(file, length - 4)
    options = _options(body[16:], order)
    return _Section(order), options.get(OPT_COMMENT, b"").decode("utf-8", "replace")


def _interface(body: bytes, section: _Section) -> _Interface:
    if len(body) < 8 or len(section.interfaces) >= MAX_INTERFACES:
        raise ProtocolError("An interface's description is cut, or there are too many")
    link_type = struct.unpack_from(section.order + "H", body)[0]
    options = _options(body[8:], section.order)
    offset = options.get(OPT_TSOFFSET, b"").ljust(8, b"\0")[:8]
    return _Interface(
        link_type=link_type,
        name=options.get(OPT_IF_NAME, b"").decode("utf-8", "replace"),
        ticks=_tick_ns((options.get(OPT_TSRESOL) or b"\x06")[0]),
        offset_ns=struct.unpack(section.order + "q", offset)[0] * 10**9,
    )


def _tick_ns(resolution: int) -> tuple[int, int]:
    """Nanoseconds of a tick: the resolution byte is a power of ten, or of two where its top bit is set."""
    exponent = resolution & 0x7F
    return 10**9, (2 if resolution & 0x80 else 10) ** exponent


def _packet(body: bytes, section: _Section, kind: int) -> Packet:
    layout = struct.Struct(section.order + ("IIIII" if kind == ENHANCED_PACKET else "HHIIII"))
    if len(body) < layout.size:
        raise ProtocolError("A packet block is cut")
    number, *_, high, low, kept, original = layout.unpack_from(body)
    if number >= len(section.interfaces) or kept > len(body) - layout.size:
        raise ProtocolError("A packet block names an unknown interface or more bytes than it has")
    interface = section.interfaces[number]
    numerator, denominator = interface.ticks
    time_ns = ((high << 32) + low) * numerator // denominator + interface.offset_ns
    end = layout.size + kept
    flags = _options(body[end + -kept % 4 :], section.order).get(OPT_FLAGS, b"").ljust(4, b"\0")
    return Packet(
        time_ns=time_ns,
        link_type=interface.link_type,
        interface=interface.name,
        data=body[layout.size : end],
        whole=kept >= original,
        flags=struct.unpack(section.order + "I", flags[:4])[0] & 3,
    )


def _options(data: bytes, order: str) -> dict[int, bytes]:
    """Options by code, the last of each; a cut list gives what is whole."""
    options = {}
    at = 0
    while at + 4 <= len(data):
        code, length = struct.unpack_from(order + "HH", data, at)
        if code == 0 or at + 4 + length > len(data):
            break
        options[code] = data[at + 4 : at + 4 + length]
        at += 4 + length + -length % 4
    return options
