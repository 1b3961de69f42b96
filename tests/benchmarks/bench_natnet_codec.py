"""Reading and writing a face's frames: 24 markers, twice in marker sets and once labelled, and one rigid body.

Peers are asked for the same bytes in the same run. `optirx` reads no more than 2.9.
"""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING

from retarget.udp.natnet.codec import decode, encode
from retarget.udp.natnet.framedata import FrameOfData
from retarget.udp.natnet.version import Bitstream
from tests.benchmarks.report import Row, seconds_per_call
from tests.udp.natnet.examples import face_frame
from tests.udp.natnet.peers import natnet_frame, natnetsdk_frame, optirx_frame

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    Read = Callable[[bytes, tuple[int, int]], Any]

VERSIONS = (Bitstream(2, 5), Bitstream(2, 9), Bitstream(3, 0), Bitstream(4, 1), Bitstream(4, 2))
BATCH = 20


def rows() -> Iterator[Row]:
    """Frames a second, ours with the labelled markers' positions in hand; then writing."""
    for version in VERSIONS:
        yield _decoding(version, "natnet", natnet_frame, "10x" if version >= (4, 1) else "")
    yield _decoding(Bitstream(4, 1), "natnetsdk", natnetsdk_frame, "10x")
    yield _decoding(Bitstream(2, 9), "optirx", optirx_frame, "")
    for version in VERSIONS:
        yield _encoding(version)


def _decoding(version: Bitstream, peer: str, read: Read, aim: str) -> Row:
    datagram = encode(face_frame(), version)
    ours = _per_second(lambda: _positions(datagram, version))
    theirs = _per_second(lambda: read(datagram, version)) if importlib.util.find_spec(peer) else None
    return Row(f"decode {version}, {len(datagram)} bytes", ours, "frames/s", peer, theirs, aim)


def _encoding(version: Bitstream) -> Row:
    frame = face_frame()
    return Row(f"encode {version}", _per_second(lambda: encode(frame, version)), "frames/s")


def _positions(datagram: bytes, version: Bitstream) -> object:
    frame = decode(datagram, version)
    return frame.labelled.positions if isinstance(frame, FrameOfData) else None


def _per_second(call: Callable[[], object]) -> float:
    def batch() -> None:
        for _ in range(BATCH):
            call()

    return BATCH / seconds_per_call(batch, repeat=100)
