"""Bounded reading of the MCAP records that a take holds: bytes in, values out, ProtocolError and nothing else.

Written apart from the stock library, which stops at a cut file and believes lengths. Layout: https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from retarget.errors import ProtocolError

if TYPE_CHECKING:
    from collections.abc import Iterator

MAGIC: Final = b"\x89MCAP0\r\n"
RECORD_HEAD: Final = struct.Struct("<BQ")
FOOTER_BYTES: Final = RECORD_HEAD.size + 20
"""Of the footer record, which stands just before the closing magic."""

HEADER, FOOTER, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = 0x01, 0x02, 0x04, 0x05, 0x06, 0x07, 0x08
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, DATA_END = 0x09, 0x0A, 0x0B, 0x0C, 0x0D, 0x0F

MAX_UNCOMPRESSED_BYTES: Final = 16 * 1024 * 1024
"""Of one chunk; the recorder writes 64 KiB, other programs some MiB."""

_MESSAGE_HEAD: Final = struct.Struct("<HIQQ")
_CHUNK_HEAD: Final = struct.Struct("<QQQII")
CHUNK_HEAD_BYTES: Final = _CHUNK_HEAD.size


@dataclass(frozen=True, slots=True)
class ChunkSpan:
    """Where a chunk's record is, and the wall-clock times of its messages."""

    offset: int
    """Of the record's content in the file, after opcode and length."""
    length: int
    """Of the content [bytes]."""
    start_ns: int
    end_ns: int


class Cursor:
    """Reads little-endian fields one after another; raises ProtocolError before it would read past the end."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    @property
    def left(self) -> int:
        """Bytes not yet read."""
        return len(self._data) - self._at

    def raw(self, count: int) -> bytes:
        """The next `count` bytes."""
        if count > self.left:
            raise ProtocolError(f"A record claims {count} bytes where {self.left} are left")
        self._at += count
        return self._data[self._at - count : self._at]

    def unsigned(self, size: int) -> int:
        """An unsigned integer of `size` bytes."""
        return int.from_bytes(self.raw(size), "little")

    def text(self) -> str:
        """A text with its length in front; bytes that are no UTF-8 become replacement characters."""
        return self.raw(self.unsigned(4)).decode("utf-8", "replace")


def records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """(opcode, content) of records that stand one after another."""
    at = 0
    while at < len(data):
        if at + RECORD_HEAD.size > len(data):
            raise ProtocolError("A record's head is cut")
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        at += RECORD_HEAD.size
        if length > len(data) - at:
            raise ProtocolError(f"A record claims {length} bytes where {len(data) - at} are left")
        yield opcode, data[at : at + length]
        at += length


def footer(data: bytes) -> tuple[int, int, int]:
    """(start of the summary, start of its offset section, CRC) of a footer's content."""
    cursor = Cursor(data)
    return cursor.unsigned(8), cursor.unsigned(8), cursor.unsigned(4)


def channel(data: bytes) -> tuple[int, str, str]:
    """(id, topic, message encoding)."""
    cursor = Cursor(data)
    number = cursor.unsigned(2)
    cursor.raw(2)
    return number, cursor.text(), cursor.text()


def chunk_span(data: bytes) -> ChunkSpan:
    """A chunk index record's chunk."""
    cursor = Cursor(data)
    start, end, offset, length = (cursor.unsigned(8) for _ in range(4))
    return ChunkSpan(offset + RECORD_HEAD.size, length - RECORD_HEAD.size, start, end)


def chunk_times(head: bytes) -> tuple[int, int]:
    """(first, last) message time [ns] from the first `CHUNK_HEAD_BYTES` of a chunk's content."""
    if len(head) < CHUNK_HEAD_BYTES:
        raise ProtocolError("A chunk's head is cut")
    start, end, *_ = _CHUNK_HEAD.unpack_from(head)
    return start, end


def chunk_body(data: bytes) -> bytes:
    """The records inside a chunk, decompressed and checked against its CRC."""
    if len(data) < CHUNK_HEAD_BYTES:
        raise ProtocolError("A chunk's head is cut")
    _, _, size, crc, name_length = _CHUNK_HEAD.unpack_from(data)
    cursor = Cursor(data)
    cursor.raw(CHUNK_HEAD_BYTES)
    compression = cursor.raw(name_length)
    packed = cursor.raw(cursor.unsigned(8))
    if size > MAX_UNCOMPRESSED_BYTES:
        raise ProtocolError(f"A chunk claims {size} bytes, more than {MAX_UNCOMPRESSED_BYTES}")
    body = _decompressed(packed, compression, size)
    if len(body) != size or (crc and zlib.crc32(body) != crc):
        raise ProtocolError("A chunk's checksum is wrong")
    return body


def messages(body: bytes) -> Iterator[tuple[int, int, bytes]]:
    """(channel id, log time [ns], data) of each message of a chunk's body."""
    for opcode, content in records(body):
        if opcode != MESSAGE:
            continue
        if len(content) < _MESSAGE_HEAD.size:
            raise ProtocolError("A message's head is cut")
        number, _, stamp, _ = _MESSAGE_HEAD.unpack_from(content)
        yield number, stamp, content[_MESSAGE_HEAD.size :]


def message_count(index: bytes) -> tuple[int, int]:
    """(channel id, number of messages) of a message index record."""
    cursor = Cursor(index)
    number, size = cursor.unsigned(2), cursor.unsigned(4)
    cursor.raw(size)
    return number, size // 16


def statistics(data: bytes) -> dict[int, int]:
    """Messages by channel id."""
    cursor = Cursor(data)
    cursor.raw(8 + 2 + 4 * 4 + 2 * 8)
    entries = Cursor(cursor.raw(cursor.unsigned(4)))
    counts = {}
    while entries.left:
        number = entries.unsigned(2)
        counts[number] = entries.unsigned(8)
    return counts


def metadata(data: bytes) -> tuple[str, dict[str, str]]:
    """(name, values) of a metadata record."""
    cursor = Cursor(data)
    name = cursor.text()
    entries = Cursor(cursor.raw(cursor.unsigned(4)))
    values = {}
    while entries.left:
        key = entries.text()
        values[key] = entries.text()
    return name, values


def attachment(data: bytes) -> tuple[str, bytes]:
    """(name, data) of an attachment record, checked against its CRC."""
    cursor = Cursor(data)
    cursor.raw(16)
    name = cursor.text()
    cursor.text()
    content = cursor.raw(cursor.unsigned(8))
    crc = cursor.unsigned(4)
    if crc and zlib.crc32(data[:-4]) != crc:
        raise ProtocolError(f"The checksum of the attachment {name!r} is wrong")
    return name, content


def location(data: bytes) -> tuple[int, int]:
    """(offset, length) of the record that an attachment index or metadata index points to."""
    cursor = Cursor(data)
    return cursor.unsigned(8), cursor.unsigned(8)


def _decompressed(packed: bytes, compression: bytes, size: int) -> bytes:
    if not compression:
        return packed
    if compression != b"lz4":
        name = compression[:20].decode("ascii", "replace")
        raise ProtocolError(
            f"A chunk is compressed with {name!r}; a take's chunks are compressed with lz4 or not at all"
        )
    import lz4.frame

    try:
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1))
    except RuntimeError as error:
        raise ProtocolError("A chunk's compressed data is damaged") from error
