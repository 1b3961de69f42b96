"""A client nobody here wrote, in a process of its own: it may hang on what it reads.

Reads datagrams from standard input, each behind its length in four bytes; says "!" when it is ready, then answers "b"
when the client believed one, "r" when it refused it with any exception.
"""

from __future__ import annotations

import contextlib
import io
import sys
from typing import TYPE_CHECKING

from tests.udp.natnet.peers import natnet_frame, optirx_frame

if TYPE_CHECKING:
    from collections.abc import Callable


def main() -> None:
    """Serve until standard input ends; arguments: the client's name, major and minor version."""
    read = _reader(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
    sys.stdout.buffer.write(b"!")
    sys.stdout.buffer.flush()
    while header := sys.stdin.buffer.read(4):
        datagram = sys.stdin.buffer.read(int.from_bytes(header, "little"))
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                read(datagram)
            verdict = b"b"
        except Exception:
            verdict = b"r"
        sys.stdout.buffer.write(verdict)
        sys.stdout.buffer.flush()


def _reader(name: str, major: int, minor: int) -> Callable[[bytes], object]:
    read = {"natnet": natnet_frame, "optirx": optirx_frame}[name]
    with contextlib.suppress(Exception):
        read(b"", (major, minor))  # imports the client before the first datagram's time runs
    return lambda datagram: read(datagram, (major, minor))


if __name__ == "__main__":
    main()
