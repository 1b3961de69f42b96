"""MCAP records of a take, as bytes: opening, chunks, attachments and the closing index. Opens no file.

The stock library's record classes write everything that is rare; messages, chunks and message indexes, of which there
are many, are packed here. Layout: the MCAP specification (https://mcap.dev/spec).
"""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING, Final

from retarget.take import message
from retarget.take.metadata import RECORD_NAME, TakeMetadata, wall_ns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mcap.records import AttachmentIndex, McapRecord, MetadataIndex

    from retarget.udp.datagram import Datagram

MAGIC: Final = b"\x89MCAP0\r\n"
CHANNEL_IDS: Final[dict[message.Channel, int]] = {"command": 1, "data": 2}

_MESSAGE: Final = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_MESSAGE_OPCODE: Final = 0x05
_MESSAGE_FIXED: Final = 22
_CHUNK: Final = struct.Struct(
    "<BQQQQII"
)  # opcode, length, start, end, uncompressed size, its CRC, length of the next text
_CHUNK_OPCODE: Final = 0x06
_MESSAGE_INDEX: Final = struct.Struct("<BQHI")  # opcode, length, channel, bytes of entries
_MESSAGE_INDEX_OPCODE: Final = 0x07
_COMPRESSION: Final = b"lz4"


class TakeBytes:
    """Makes the bytes of one take in order; knows how far the file has grown, for the index at its end."""

    def __init__(self, metadata: TakeMetadata) -> None:
        self._metadata = metadata.with_clock_offset()
        self._offset_ns = self._metadata.clock_offset_ns or 0
        self._size = 0
        self._counts = dict.fromkeys(CHANNEL_IDS, 0)
        self._chunks = bytearray()  # index records as bytes: an hour holds some 36,000
        self._chunk_count = 0
        self._start_ns: int | None = None
        self._end_ns = 0
        self._attachments: list[AttachmentIndex] = []
        self._metadata_index: list[MetadataIndex] = []

    def opening(self) -> bytes:
        """Magic, header, metadata and channels: what must come first."""
        import lz4.frame  # noqa: F401  # here, not while the first chunk waits to be written
        from mcap.records import Header, Metadata, MetadataIndex

        header = MAGIC + _bytes_of(Header(profile="", library="retarget"))
        metadata = _bytes_of(Metadata(RECORD_NAME, self._metadata.as_text_map()))
        self._metadata_index.append(MetadataIndex(len(header), len(metadata), RECORD_NAME))
        return self._grown_by(header + metadata + b"".join(map(_bytes_of, _channels())))

    def attachment(self, name: str, media_type: str, data: bytes, received_s: float) -> bytes:
        """One attachment, stamped `received_s` [s, monotonic]."""
        from mcap.records import Attachment, AttachmentIndex

        stamp = wall_ns(received_s, self._offset_ns)
        record = _bytes_of(Attachment(create_time=0, log_time=stamp, name=name, media_type=media_type, data=data))
        self._attachments.append(AttachmentIndex(self._size, len(record), stamp, 0, len(data), name, media_type))
        return self._grown_by(record)

    def chunk(self, datagrams: Sequence[Datagram]) -> bytes:
        """A compressed chunk of at least one datagram, with its message indexes."""
        import lz4.frame
        from mcap.records import ChunkIndex

        body, stamps, entries = self._messages(datagrams)
        packed = lz4.frame.compress(body)
        start, end = min(stamps), max(stamps)
        length = _CHUNK.size - 9 + len(_COMPRESSION) + 8 + len(packed)
        head = _CHUNK.pack(_CHUNK_OPCODE, length, start, end, len(body), zlib.crc32(body), len(_COMPRESSION))
        record = b"".join((head, _COMPRESSION, struct.pack("<Q", len(packed)), packed))
        indexes, offsets = _message_indexes(entries, self._size + len(record))
        index = ChunkIndex(
            message_start_time=start,
            message_end_time=end,
            chunk_start_offset=self._size,
            chunk_length=len(record),
            message_index_offsets=offsets,
            message_index_length=len(indexes),
            compression=_COMPRESSION.decode(),
            compressed_size=len(packed),
            uncompressed_size=len(body),
        )
        self._chunks += _bytes_of(index)
        self._chunk_count += 1
        self._start_ns = start if self._start_ns is None else min(self._start_ns, start)
        self._end_ns = max(self._end_ns, end)
        return self._grown_by(record + indexes)

    def closing(self) -> bytes:
        """End of data, the summary with every index, and the footer; nothing may follow."""
        from mcap.records import DataEnd, Footer

        end_of_data = _bytes_of(DataEnd(0))
        summary_start = self._size + len(end_of_data)
        rare: list[Sequence[McapRecord]] = [_channels(), [self._statistics()], self._attachments, self._metadata_index]
        groups = [*(b"".join(map(_bytes_of, records)) for records in rare), bytes(self._chunks)]
        summary, offsets = _summary(groups, summary_start)
        offsets_start = summary_start + len(summary)
        footer = _bytes_of(Footer(summary_start, offsets_start, 0))[:-4]
        crc = zlib.crc32(footer, zlib.crc32(summary + offsets))
        return self._grown_by(end_of_data + summary + offsets + footer + struct.pack("<I", crc) + MAGIC)

    def _messages(self, datagrams: Sequence[Datagram]) -> tuple[bytes, list[int], dict[int, list[int]]]:
        parts: list[bytes] = []
        stamps: list[int] = []
        entries: dict[int, list[int]] = {}
        at = 0
        for datagram in datagrams:
            channel = CHANNEL_IDS[datagram.channel]
            data = message.pack(datagram)
            stamp = wall_ns(datagram.received_s, self._offset_ns)
            sequence = self._counts[datagram.channel] & 0xFFFF_FFFF
            self._counts[datagram.channel] += 1
            parts += (
                _MESSAGE.pack(_MESSAGE_OPCODE, _MESSAGE_FIXED + len(data), channel, sequence, stamp, stamp),
                data,
            )
            stamps.append(stamp)
            entries.setdefault(channel, []).extend((stamp, at))
            at += _MESSAGE.size + len(data)
        return b"".join(parts), stamps, entries

    def _statistics(self) -> McapRecord:
        from mcap.records import Statistics

        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(CHANNEL_IDS),
            channel_message_counts={CHANNEL_IDS[name]: count for name, count in self._counts.items() if count},
            chunk_count=self._chunk_count,
            message_count=sum(self._counts.values()),
            message_start_time=self._start_ns or 0,
            message_end_time=self._end_ns,
            metadata_count=len(self._metadata_index),
            schema_count=0,
        )

    def _grown_by(self, data: bytes) -> bytes:
        self._size += len(data)
        return data


def _bytes_of(record: McapRecord) -> bytes:
    from mcap.data_stream import RecordBuilder

    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def _channels() -> list[McapRecord]:
    from mcap.records import Channel

    return [
        Channel(CHANNEL_IDS[name], topic, message.ENCODING, {"layout": message.LAYOUT}, 0)
        for name, topic in message.TOPICS.items()
    ]


def _message_indexes(entries: dict[int, list[int]], start: int) -> tuple[bytes, dict[int, int]]:
    """The records, and where each channel's begins in the file; an entry is a stamp and an offset in the chunk."""
    records, offsets = b"", {}
    for channel, numbers in entries.items():
        offsets[channel] = start + len(records)
        size = 8 * len(numbers)
        head = _MESSAGE_INDEX.pack(_MESSAGE_INDEX_OPCODE, 6 + size, channel, size)
        records += head + struct.pack(f"<{len(numbers)}Q", *numbers)
    return records, offsets


def _summary(groups: Sequence[bytes], start: int) -> tuple[bytes, bytes]:
    """The groups of records, one after another from `start`, and the records that tell where each group is."""
    from mcap.records import SummaryOffset

    offsets = b""
    for group in filter(None, groups):
        offsets += _bytes_of(SummaryOffset(group[0], start, len(group)))
        start += len(group)
    return b"".join(groups), offsets
