"""From any file that holds markers to any other: takes, captures, C3D, TRC and Motive's CSV, by their endings.

Between takes and captures the datagrams are copied as they are. Towards marker files they are decoded; from marker
files they are what our server would send. The target appears whole or not at all.
"""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from retarget.errors import InputError, OutputError
from retarget.take.append_file import AppendFile
from retarget.take.capture_writer import write_capture
from retarget.take.decode import clip_of
from retarget.take.encode import datagrams_of, metadata_of
from retarget.take.mcap_writer import TakeBytes
from retarget.take.reader import read_take
from retarget.take.recorder import CHUNK_BYTES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from retarget.markers.clip import MarkerClip
    from retarget.take.metadata import TakeMetadata
    from retarget.take.reader import Take
    from retarget.udp.datagram import Datagram

_T = TypeVar("_T")

TAKES: Final = (".mcap", ".pcapng", ".pcap")
"""Endings of files of datagrams."""
CLIPS: Final = (".c3d", ".trc", ".csv")
"""Endings of files of markers."""
TARGETS: Final = (".mcap", ".pcapng", *CLIPS)


@dataclass(frozen=True, slots=True)
class Conversion:
    """What came of a conversion."""

    target: Path
    unit: str
    """"datagrams" or "frames"."""
    count: int
    notes: tuple[str, ...]
    """What had to be decided or could not be kept, one sentence each."""


def convert(source: Path, target: Path) -> Conversion:
    """Write what is in `source` to `target`.

    Raises InputError where `source` cannot be read or does not fit the target's format, OutputError where `target`
    cannot be written. A recording that exists is not overwritten, as it may be the only one; another file is.
    """
    kind, into = source.suffix.lower(), target.suffix.lower()
    if kind not in TAKES + CLIPS:
        raise InputError(f"{source} cannot be converted; expected a file that ends in {', '.join(TAKES + CLIPS)}")
    if into not in TARGETS:
        raise InputError(f"{target} cannot be written; expected a name that ends in {', '.join(TARGETS)}")
    if into in TAKES and target.exists():
        raise OutputError(f"{target} exists, and a recording is never overwritten: choose another name or remove it")
    if kind in TAKES and into in TAKES:
        return _copy_datagrams(read_take(source), target)
    clip = clip_of(read_take(source)) if kind in TAKES else read_clip(source)
    return _to_datagrams(clip, target) if into in TAKES else _to_clip(clip, target)


def read_clip(path: Path) -> MarkerClip:
    """The markers of a C3D, TRC or Motive CSV file, by its ending. Raises InputError."""
    from retarget.markers.c3d import read_c3d
    from retarget.markers.motive_csv import read_motive_csv
    from retarget.markers.trc import read_trc

    read = {".c3d": read_c3d, ".trc": read_trc, ".csv": read_motive_csv}.get(path.suffix.lower())
    if read is None:
        raise InputError(f"{path} is no marker file; expected a name that ends in {', '.join(CLIPS)}")
    return read(path)


def write_take(
    path: Path, datagrams: Iterable[Datagram], metadata: TakeMetadata, attachments: Mapping[str, bytes] | None = None
) -> int:
    """Write a whole take as MCAP and return the number of datagrams. Raises OutputError if `path` exists, OSError."""
    writer, file = TakeBytes(metadata), AppendFile(path)
    count = 0
    try:
        file.append(writer.opening())
        for name, data in (attachments or {}).items():
            file.append(writer.attachment(name, "application/octet-stream", data, 0.0))
        for chunk in _chunks(datagrams):
            file.append(writer.chunk(chunk))
            count += len(chunk)
        file.append(writer.closing())
        file.sync()
    finally:
        file.close()
    return count


def _copy_datagrams(take: Take, target: Path) -> Conversion:
    notes = [take.cut] if take.cut else []
    if target.suffix.lower() == ".mcap":
        count = _whole(target, lambda path: write_take(path, take, take.metadata, take.attachments))
    else:
        count = _whole(target, lambda path: write_capture(path, take, take.metadata))
        notes += [f"A capture has no room for the attachment {name!r}; it is left out." for name in take.attachments]
    return Conversion(target, "datagrams", count, tuple(notes))


def _to_datagrams(clip: MarkerClip, target: Path) -> Conversion:
    write = write_take if target.suffix.lower() == ".mcap" else write_capture
    count = _whole(target, lambda path: write(path, datagrams_of(clip), metadata_of(clip)))
    return Conversion(target, "datagrams", count, clip.notes)


def _to_clip(clip: MarkerClip, target: Path) -> Conversion:
    from retarget.markers.motive_csv import write_motive_csv
    from retarget.markers.trc import write_trc
    from retarget.markers.write_c3d import keeps_first_frame, write_c3d

    into = target.suffix.lower()
    notes = clip.notes
    if into == ".c3d" and not keeps_first_frame(clip):
        notes = (*notes, f"C3D cannot number frames up to {clip.first_frame + len(clip) - 1}; there they start with 1.")
    write = {".c3d": write_c3d, ".trc": write_trc, ".csv": write_motive_csv}[into]
    _whole(target, lambda path: write(path, clip))
    return Conversion(target, "frames", len(clip), notes)


def _whole(target: Path, write: Callable[[Path], _T]) -> _T:
    """Let `write` make the file in a folder beside `target`, and put it in its place once it is complete."""
    try:
        folder = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.parent))
        try:
            made = folder / target.name
            result = write(made)
            made.replace(target)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    except OSError as error:
        raise OutputError(f"{target} cannot be written: {error.strerror}") from error
    return result


def _chunks(datagrams: Iterable[Datagram]) -> Iterator[list[Datagram]]:
    chunk: list[Datagram] = []
    size = 0
    for datagram in datagrams:
        chunk.append(datagram)
        size += len(datagram.payload)
        if size >= CHUNK_BYTES:
            yield chunk
            chunk, size = [], 0
    if chunk:
        yield chunk
