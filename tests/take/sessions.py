"""Datagrams for tests: made up ones, and those of the recorded Motive session."""

from __future__ import annotations

import random
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from retarget.take.append_file import AppendFile
from retarget.take.mcap_writer import TakeBytes
from retarget.take.metadata import TakeMetadata
from retarget.udp.datagram import Datagram

if TYPE_CHECKING:
    from collections.abc import Iterable

SHARED = Path(__file__).parents[2] / "../shared/data"
SESSION = SHARED / "natnet/motive-2.1_natnet-3.0_session.pcapng"
METADATA = TakeMetadata(source="natnet://10.0.0.7", layout="face24", versions={"natnet": "4.1"}, clock_offset_ns=10**18)


def motive_session() -> Path:
    """The real capture; the test is skipped where it is not at hand."""
    if not SESSION.exists():
        pytest.skip(f"{SESSION.name} is not beside the project")
    return SESSION


def made_up(
    count: int, longest: int = 300, seed: int = 1, start_s: float = 1000.0, rate_hz: float = 120.0
) -> list[Datagram]:
    """`count` datagrams with random bytes; every tenth goes out on the command channel."""
    rng = random.Random(seed)
    return [
        Datagram(start_s + i / rate_hz, "out", "command", ("10.0.0.7", 1510), rng.randbytes(12))
        if i % 10 == 9
        else Datagram(start_s + i / rate_hz, "in", "data", ("10.0.0.7", 1511), rng.randbytes(rng.randint(0, longest)))
        for i in range(count)
    ]


def write_chunks(path: Path, chunks: Iterable[list[Datagram]], metadata: TakeMetadata = METADATA) -> list[int]:
    """A whole take of the given chunks; returns the file's size after the opening and after each chunk."""
    writer, file = TakeBytes(metadata), AppendFile(path)
    file.append(writer.opening())
    sizes = [path.stat().st_size]
    for chunk in chunks:
        file.append(writer.chunk(chunk))
        sizes.append(path.stat().st_size)
    file.append(writer.closing())
    file.close()
    return sizes
