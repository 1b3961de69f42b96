"""Takes from disk: whole or cut short, in the order in which they were recorded, byte for byte the same every time."""

from __future__ import annotations

import logging
from bisect import bisect_left
from dataclasses import dataclass, field
from itertools import accumulate
from typing import TYPE_CHECKING

from retarget.errors import InputError, ProtocolError
from retarget.take import mcap_records as mcap
from retarget.take.index import TakeIndex, read_content, read_index
from retarget.take.message import unpack
from retarget.take.metadata import TakeMetadata, from_text_map

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from pathlib import Path

    from retarget.udp.datagram import Datagram

log = logging.getLogger("retarget.take")


@dataclass(frozen=True, slots=True, eq=False)
class Take:
    """A recorded session. Iterating gives its datagrams, any number of times."""

    path: Path
    metadata: TakeMetadata
    counts: Mapping[str, int]
    """Datagrams by channel, "command" and "data"."""
    start_s: float
    """The recorder's monotonic time of the first datagram [s]."""
    duration_s: float
    """From the first datagram to the last [s]."""
    datagrams_from: Callable[[float], Iterator[Datagram]]
    """Gives the datagrams that were received at the given monotonic time [s] or later."""
    attachments: Mapping[str, bytes] = field(default_factory=dict)
    cut: str = ""
    """What is missing, as one sentence; empty for a whole take."""

    def __iter__(self) -> Iterator[Datagram]:
        return self.datagrams_from(self.start_s)

    def seek(self, time_s: float) -> Iterator[Datagram]:
        """The datagrams from `time_s` after the start [s] on."""
        return self.datagrams_from(self.start_s + time_s)


def read_take(path: Path) -> Take:
    """Open a take: an MCAP file of ours, or a capture as Wireshark writes it (pcapng, pcap).

    A take that was cut, by a power failure or a full disk, opens up to its last whole chunk and says so in the log.
    Raises InputError where there is nothing in it or it is something else.
    """
    from retarget.take.capture import is_capture, read_capture

    try:
        with path.open("rb") as file:
            start = file.read(len(mcap.MAGIC))
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from error
    if not start:
        raise InputError(f"{path} is empty")
    return read_capture(path) if is_capture(start) else _read_mcap(path)


def _read_mcap(path: Path) -> Take:
    try:
        with path.open("rb") as file:
            index = read_index(file, path.stat().st_size)
    except ProtocolError as error:
        raise InputError(f"{path} is no take: {error}. Takes are .mcap, .pcapng or .pcap files") from error
    if not index.channels and index.spans:
        raise InputError(f"{path} is an MCAP file without NatNet datagrams: it was not recorded by this program")
    chunks = _Chunks(path, index)
    first = next(chunks.all(), None)
    if first is None:
        raise InputError(f"{path}: there is no datagram in it")
    start_ns, end_ns = min(s.start_ns for s in index.spans), max(s.end_ns for s in index.spans)
    take = Take(
        path=path,
        metadata=from_text_map(index.texts),
        counts=index.counts,
        start_s=first.received_s,
        duration_s=(end_ns - start_ns) / 1e9,
        datagrams_from=chunks.received_from,
        attachments=index.attachments,
        cut=_cut_sentence(path, index, (end_ns - start_ns) / 1e9),
    )
    if take.cut:
        log.warning("%s", take.cut)
    return take


def _cut_sentence(path: Path, index: TakeIndex, duration_s: float) -> str:
    if index.cut_at is None:
        return ""
    count = sum(index.counts.values())
    return (
        f"{path} was not closed properly and is cut at byte {index.cut_at}: "
        f"{count} datagrams over {duration_s:.3f} s are whole and were read, anything after is lost"
    )


class _Chunks:
    """The datagrams of a file whose chunks are known. Every iterator opens the file for itself."""

    def __init__(self, path: Path, index: TakeIndex) -> None:
        self._path = path
        self._index = index
        self._latest_ns = list(accumulate((span.end_ns for span in index.spans), max))
        self._offset_ns = from_text_map(index.texts).clock_offset_ns

    def all(self) -> Iterator[Datagram]:
        """Every datagram."""
        return self._from_chunk(0)

    def received_from(self, time_s: float) -> Iterator[Datagram]:
        """Datagrams received at `time_s` [s, monotonic] or later."""
        start = 0
        if self._offset_ns is not None:
            stamp = int(time_s * 1e9) + self._offset_ns - 1000  # a stamp in the file is rounded to the nanosecond
            start = bisect_left(self._latest_ns, stamp)
        return (datagram for datagram in self._from_chunk(start) if datagram.received_s >= time_s)

    def _from_chunk(self, start: int) -> Iterator[Datagram]:
        with self._path.open("rb") as file:
            for span in self._index.spans[start:]:
                try:
                    yield from list(self._datagrams(read_content(file, span)))
                except ProtocolError as error:
                    length = (span.end_ns - span.start_ns) / 1e9
                    log.warning("%s: %.3f s at byte %d are lost: %s", self._path, length, span.offset, error)

    def _datagrams(self, body: bytes) -> Iterator[Datagram]:
        channels = self._index.channels
        return (unpack(data, channels[number]) for number, _, data in mcap.messages(body) if number in channels)
