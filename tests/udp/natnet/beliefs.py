"""How many frames whose structure is certainly wrong a decoder believes: ours, and clients that nobody here wrote."""

from __future__ import annotations

import importlib.util
import random
import selectors
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from retarget.errors import ProtocolError
from retarget.udp.natnet.codec import decode, encode
from retarget.udp.natnet.frame_reading import read_frame
from retarget.udp.natnet.reader import Cursor
from retarget.udp.natnet.version import Bitstream, layout_of
from tests.udp.natnet.examples import face_frame

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import TracebackType

ROOT = Path(__file__).parents[3]
PATIENCE_S = 1.0
DELTAS = (-(2**31), -3, -1, 1, 2, 5, 100, 2**20, 2**30)


class _Tracing(Cursor):
    """Remembers where the whole numbers are."""

    __slots__ = ("numbers",)

    def __init__(self, data: bytes, at: int) -> None:
        super().__init__(data, at)
        self.numbers: list[int] = []

    def int32(self) -> int:
        self.numbers.append(self.at)
        return super().int32()

    def int32_pair(self) -> tuple[int, int]:
        self.numbers += [self.at, self.at + 4]
        return super().int32_pair()


def counts_and_sizes(datagram: bytes, version: Bitstream) -> list[int]:
    """Where a frame without skeletons, assets and analog data keeps its counts and section sizes."""
    cursor = _Tracing(datagram, 4)
    read_frame(cursor, layout_of(version))
    return cursor.numbers[1:]


def inconsistent_frames(count: int, seed: int, version: Bitstream) -> Iterator[bytes]:
    """Frames that no sender meant: cut, with bytes lost, with bytes behind, or with a count or size changed."""
    rng = random.Random(seed)
    valid = encode(face_frame(), version)
    numbers = counts_and_sizes(valid, version)
    block = valid.rfind(face_frame().labelled.positions[0].tobytes())
    for _ in range(count):
        kind = rng.randrange(8)
        if kind == 0:
            yield valid[: rng.randrange(4, len(valid))]
        elif kind == 1:
            yield valid + rng.randbytes(rng.randrange(1, 30))
        elif kind == 2:
            yield valid[:block] + valid[block + rng.randrange(1, 12) :]
        else:
            yield _with_another_number(rng, valid, rng.choice(numbers))


def _with_another_number(rng: random.Random, valid: bytes, at: int) -> bytes:
    number = (int.from_bytes(valid[at : at + 4], "little") + rng.choice(DELTAS)) % 2**32
    return valid[:at] + number.to_bytes(4, "little") + valid[at + 4 :]


@dataclass(slots=True)
class Peer:
    """Another client's decoder in a process of its own, started again when it hangs."""

    name: str
    version: Bitstream
    process: subprocess.Popen[bytes] | None = field(default=None, init=False)

    def __enter__(self) -> Peer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self._stop()

    def verdict(self, datagram: bytes) -> str:
        """Say "believed", "refused" or "hung": no answer within a second."""
        process = self.process or self._start()
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(len(datagram).to_bytes(4, "little") + datagram)
        process.stdin.flush()
        with selectors.DefaultSelector() as selector:
            selector.register(process.stdout, selectors.EVENT_READ)
            if not selector.select(PATIENCE_S):
                self._stop()
                return "hung"
        return {b"b": "believed", b"r": "refused"}[process.stdout.read(1)]

    def _start(self) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "tests.udp.natnet.peer_worker", self.name, *map(str, self.version)]
        self.process = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self.process.stdout is not None
        assert self.process.stdout.read(1) == b"!", f"{self.name} did not start"
        return self.process

    def _stop(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
            self.process = None


def our_verdicts(count: int, seed: int, version: Bitstream) -> Counter[str]:
    """How often we believe or refuse."""
    return Counter(_our_verdict(datagram, version) for datagram in inconsistent_frames(count, seed, version))


def _our_verdict(datagram: bytes, version: Bitstream) -> str:
    try:
        decode(datagram, version)
    except ProtocolError:
        return "refused"
    return "believed"


def peer_verdicts(name: str, count: int, seed: int, version: Bitstream) -> Counter[str]:
    """How often another client believes, refuses or hangs."""
    with Peer(name, version) as peer:
        return Counter(peer.verdict(datagram) for datagram in inconsistent_frames(count, seed, version))


def report(count: int, seed: int) -> Iterator[str]:
    """One line for each decoder."""
    for name, version in (("natnet", Bitstream(4, 1)), ("optirx", Bitstream(2, 9))):
        yield _line("retarget", version, our_verdicts(count, seed, version))
        if importlib.util.find_spec(name) is None:
            yield f"{name}: not installed"
        else:
            yield _line(name, version, peer_verdicts(name, count, seed, version))


def _line(name: str, version: Bitstream, verdicts: Counter[str]) -> str:
    total = verdicts.total()
    share = 100 * verdicts["believed"] / total
    return (
        f"{name} at {version}: believed {verdicts['believed']} of {total} inconsistent frames ({share:.1f} %), "
        f"refused {verdicts['refused']}, hung on {verdicts['hung']}."
    )
