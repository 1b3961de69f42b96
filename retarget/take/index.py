"""Where a take's chunks are: from the index at the file's end or, where a cut file has none, by walking its records."""

from __future__ import annotations

import zlib
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, BinaryIO, Final

from retarget.errors import ProtocolError
from retarget.take import mcap_records as mcap
from retarget.take.message import ENCODING, TOPICS, Channel
from retarget.take.metadata import RECORD_NAME

if TYPE_CHECKING:
    from collections.abc import Mapping

MAX_SUMMARY_BYTES: Final = 256 * 1024 * 1024
MAX_ATTACHMENT_BYTES: Final = 64 * 1024 * 1024
_CHANNEL_OF_TOPIC: Final[dict[str, Channel]] = {topic: name for name, topic in TOPICS.items()}


@dataclass(slots=True)
class TakeIndex:
    """What is in the file, and where; filled record by record."""

    spans: list[mcap.ChunkSpan] = field(default_factory=list)
    channels: dict[int, Channel] = field(default_factory=dict)
    """Our channels by their number in the file."""
    message_counts: Mapping[int, int] = field(default_factory=dict)
    """Messages by channel number."""
    texts: dict[str, str] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    cut_at: int | None = None
    """Byte from which nothing could be read; None for a whole file."""

    @property
    def counts(self) -> dict[str, int]:
        """Datagrams by the name of their channel."""
        return {name: self.message_counts.get(number, 0) for number, name in self.channels.items()}

    def add(self, opcode: int, content: bytes) -> None:
        """Note a record of the kinds that a take has at most a few of."""
        if opcode == mcap.CHANNEL:
            number, topic, encoding = mcap.channel(content)
            if topic in _CHANNEL_OF_TOPIC and encoding == ENCODING:
                self.channels[number] = _CHANNEL_OF_TOPIC[topic]
        elif opcode == mcap.METADATA:
            name, texts = mcap.metadata(content)
            if name == RECORD_NAME:
                self.texts = texts
        elif opcode == mcap.ATTACHMENT:
            name, data = mcap.attachment(content)
            self.attachments[name] = data


def read_index(file: BinaryIO, size: int) -> TakeIndex:
    """The index of an MCAP file of `size` bytes. Raises ProtocolError where it does not start as one."""
    file.seek(0)
    if file.read(len(mcap.MAGIC)) != mcap.MAGIC:
        raise ProtocolError("It does not start as an MCAP file")
    try:
        return _from_summary(file, size)
    except ProtocolError:
        return _from_start(file, size)


def read_content(file: BinaryIO, span: mcap.ChunkSpan) -> bytes:
    """The decompressed, checked records of one chunk. Raises ProtocolError where it is damaged."""
    file.seek(span.offset)
    return mcap.chunk_body(file.read(span.length))


def _from_summary(file: BinaryIO, size: int) -> TakeIndex:
    index = TakeIndex()
    summary, start = _summary(file, size)
    for opcode, content in mcap.records(summary):
        if opcode == mcap.CHUNK_INDEX:
            span = mcap.chunk_span(content)
            if span.length < 0 or span.offset + span.length > start:
                raise ProtocolError("The index points outside the file")
            index.spans.append(span)
        elif opcode == mcap.STATISTICS:
            index.message_counts = mcap.statistics(content)
        elif opcode in (mcap.ATTACHMENT_INDEX, mcap.METADATA_INDEX):
            index.add(*_record_at(file, *mcap.location(content), before=start))
        else:
            index.add(opcode, content)
    return index


def _summary(file: BinaryIO, size: int) -> tuple[bytes, int]:
    """(the summary's records, where they start). Raises ProtocolError where the file has no whole summary."""
    ending = mcap.FOOTER_BYTES + len(mcap.MAGIC)
    file.seek(max(0, size - ending))
    tail = file.read(ending)
    if len(tail) < ending or not tail.endswith(mcap.MAGIC) or tail[0] != mcap.FOOTER:
        raise ProtocolError("The file does not end as an MCAP file")
    start, offsets_start, crc = mcap.footer(tail[mcap.RECORD_HEAD.size :])
    length = size - ending - start
    if not 0 < length <= MAX_SUMMARY_BYTES or start == 0:
        raise ProtocolError("The file has no summary")
    file.seek(start)
    summary = file.read(length)
    if crc and zlib.crc32(tail[: mcap.FOOTER_BYTES - 4], zlib.crc32(summary)) != crc:
        raise ProtocolError("The summary's checksum is wrong")
    return summary[: offsets_start - start] if start < offsets_start else summary, start


def _record_at(file: BinaryIO, offset: int, length: int, before: int) -> tuple[int, bytes]:
    if not mcap.RECORD_HEAD.size <= length <= MAX_ATTACHMENT_BYTES or offset + length > before:
        raise ProtocolError("An index entry points outside the file, or to more than can be held")
    file.seek(offset)
    for record in mcap.records(file.read(length)):
        return record
    raise ProtocolError("The file has shrunk")


def _from_start(file: BinaryIO, size: int) -> TakeIndex:
    """Walk the records up to the first that is not whole."""
    walk = _Walk(file, size)
    walk.run()
    walk.drop_torn_chunks()
    index = walk.index
    index.message_counts = sum(walk.counts, Counter())
    index.cut_at = walk.at
    return index


class _Walk:
    """From record to record, looking only at what is needed; `at` is the end of what was whole."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self.index = TakeIndex()
        self.counts: list[Counter[int]] = []
        """Messages of each chunk by channel number."""
        self.at = len(mcap.MAGIC)
        self._file = file
        self._size = size

    def run(self) -> None:
        """Go on until the data ends, the file ends or a record makes no sense."""
        try:
            while self._step():
                pass
        except ProtocolError:
            return

    def drop_torn_chunks(self) -> None:
        """Drop chunks from the end for which the file has grown but whose bytes never came; count the last good one."""
        while self.index.spans:
            try:
                body = read_content(self._file, self.index.spans[-1])
                self.counts[-1] = Counter(number for number, _, _ in mcap.messages(body))
            except ProtocolError:
                self.at = self.index.spans.pop().offset - mcap.RECORD_HEAD.size
                self.counts.pop()
            else:
                return

    def _step(self) -> bool:
        self._file.seek(self.at)
        head = self._file.read(mcap.RECORD_HEAD.size)
        if len(head) < mcap.RECORD_HEAD.size:
            return False
        opcode, length = mcap.RECORD_HEAD.unpack(head)
        start = self.at + len(head)
        if opcode in (0, mcap.DATA_END, mcap.FOOTER) or length > self._size - start:
            return False
        self._note(opcode, start, length)
        self.at = start + length
        return True

    def _note(self, opcode: int, start: int, length: int) -> None:
        if opcode == mcap.CHUNK:
            times = mcap.chunk_times(self._file.read(min(length, mcap.CHUNK_HEAD_BYTES)))
            self.index.spans.append(mcap.ChunkSpan(start, length, *times))
            self.counts.append(Counter())
        elif opcode == mcap.MESSAGE_INDEX and self.counts:
            number, count = mcap.message_count(self._file.read(length))
            self.counts[-1][number] += count
        elif length <= MAX_ATTACHMENT_BYTES:
            self.index.add(opcode, self._file.read(length))
