"""Records a live stream: the receiver's thread hands datagrams over and never waits, a writer's thread writes them.

What is handed over is with the operating system after about `FLUSH_S`, so that a killed process loses no more, and on
the disk `SYNC_S` later, so that a power loss takes no more. Nothing is ever dropped to keep up: what the disk has not
taken waits in memory, loudly, and when `memory_bytes` are waiting the recording ends with an error.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Final, Self

from retarget.errors import OutputError
from retarget.take.append_file import AppendFile
from retarget.take.mcap_writer import TakeBytes

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

    from retarget.take.metadata import TakeMetadata
    from retarget.udp.datagram import Datagram

FLUSH_S: Final = 0.1
SYNC_S: Final = 1.0
CHUNK_BYTES: Final = 64 * 1024
MEMORY_BYTES: Final = 256 * 1024 * 1024
_FIRST_WARNING_BYTES: Final = 8 * 1024 * 1024
_OVERHEAD_BYTES: Final = 400
"""Roughly what Python needs for a datagram beside its payload."""

log = logging.getLogger("retarget.take")


class TakeRecorder:
    """A new take at `path`; call it with each `Datagram`, from any thread, and close it.

    A call returns at once and never raises: the receiver must not suffer from a full disk. Where recording has to end
    early, an error is logged, `failure` says why, and closing raises it; whoever only records asks `failure` now and
    then.

    Raises OutputError where `path` cannot be created or exists: a take is never overwritten.
    """

    def __init__(self, path: Path, metadata: TakeMetadata, memory_bytes: int = MEMORY_BYTES) -> None:
        self.path = path
        self.recorded = 0
        """Datagrams handed to the operating system so far."""
        self.unrecorded = 0
        """Datagrams that are not in the take: they came after it ended, or could not be written."""
        self.failure: OutputError | None = None
        self._bytes = TakeBytes(metadata)
        self._memory_bytes = memory_bytes
        self._warn_at = min(_FIRST_WARNING_BYTES, memory_bytes // 2)
        self._queue: deque[Datagram] = deque()
        self._queued_bytes = 0
        self._attachments: deque[tuple[str, str, bytes, float]] = deque()
        self._changed = threading.Condition()
        self._ending = threading.Event()
        self._file = AppendFile(path)
        self._open()
        self._threads = (
            threading.Thread(target=self._write_all, name="take writer", daemon=True),
            threading.Thread(target=self._sync_regularly, name="take sync", daemon=True),
        )
        for thread in self._threads:
            thread.start()

    def __call__(self, datagram: Datagram) -> None:
        """Take over one datagram."""
        with self._changed:
            if self.failure is not None or self._ending.is_set():
                self.unrecorded += 1
                return
            self._queue.append(datagram)
            self._queued_bytes += _size(datagram)
            if len(self._queue) == 1 or self._queued_bytes >= CHUNK_BYTES:
                self._changed.notify()
            waiting = self._queued_bytes
            if waiting < self._warn_at:
                return
            self._warn_at = min(2 * waiting, self._memory_bytes)
        self._tell_behind(waiting)

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Add a file's worth of bytes, such as the model definitions, as it is now."""
        with self._changed:
            self._attachments.append((name, media_type, data, time.monotonic()))
            self._changed.notify()

    def close(self) -> None:
        """Write what waits and the index. Raises OutputError where the take ended early; a second call does nothing."""
        if self._ending.is_set():
            return
        with self._changed:
            self._ending.set()
            self._changed.notify()
        for thread in self._threads:
            thread.join()
        self._sync()
        self._file.close()
        if self.failure is not None:
            raise self.failure

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except OutputError:
            if kind is None:
                raise  # an error that is already on its way says more, and ours has been logged

    def _open(self) -> None:
        try:
            self._file.append(self._bytes.opening())
        except OSError as error:
            self._file.close()
            raise OutputError(f"{self.path} cannot be written: {error.strerror}") from error

    def _tell_behind(self, waiting: int) -> None:
        if waiting < self._memory_bytes:
            limit = _megabytes(self._memory_bytes)
            behind = _megabytes(waiting)
            log.warning(
                "%s: the disk does not keep up: %s wait in memory; at %s recording ends", self.path, behind, limit
            )
            return
        self._fail(
            f"{self.path}: the disk is too slow: {_megabytes(waiting)} wait to be written, so recording has ended. "
            "All that came before is kept. Record to a faster disk"
        )

    def _fail(self, sentence: str) -> None:
        with self._changed:
            if self.failure is not None:
                return
            self.failure = OutputError(sentence)
        log.error("%s", sentence)

    def _write_all(self) -> None:
        """The writer's thread: until the end is asked for and nothing waits, or the disk refuses."""
        try:
            while self._write_batch(*self._next_batch()):
                pass
            self._file.append(self._bytes.closing())
        except OSError as error:
            self._fail(
                f"{self.path}: {error.strerror}, so recording has ended after {self.recorded} datagrams. "
                "What came before is kept. Make room or record to another disk"
            )
        except Exception as error:  # a thread that dies in silence would lose the take
            self._fail(f"{self.path}: recording has ended after {self.recorded} datagrams: {error}")
            raise
        finally:
            with self._changed:
                self.unrecorded += len(self._queue)
                self._queue.clear()

    def _next_batch(self) -> tuple[list[Datagram], list[tuple[str, str, bytes, float]]]:
        """At most a chunk's worth, as soon as that waits or `FLUSH_S` after its first; nothing at all means the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._queue or self._attachments or self._ending.is_set())
            self._changed.wait_for(lambda: self._queued_bytes >= CHUNK_BYTES or self._ending.is_set(), FLUSH_S)
            attachments = list(self._attachments)
            self._attachments.clear()
            batch, size = [], 0
            while self._queue and size < CHUNK_BYTES:
                datagram = self._queue.popleft()
                batch.append(datagram)
                size += _size(datagram)
            self._queued_bytes -= size
            return batch, attachments

    def _write_batch(self, datagrams: list[Datagram], attachments: list[tuple[str, str, bytes, float]]) -> bool:
        """False where there was nothing to write."""
        for attachment in attachments:
            self._file.append(self._bytes.attachment(*attachment))
        if datagrams:
            try:
                self._file.append(self._bytes.chunk(datagrams))
            except BaseException:
                self.unrecorded += len(datagrams)
                raise
            self.recorded += len(datagrams)
        return bool(datagrams or attachments)

    def _sync_regularly(self) -> None:
        """A thread of its own: a disk may take seconds for this, and chunks must reach the system meanwhile."""
        while not self._ending.wait(SYNC_S):
            self._sync()

    def _sync(self) -> None:
        try:
            self._file.sync()
        except OSError as error:
            self._fail(f"{self.path}: {error.strerror}, so the end of this take may be lost in a power failure")


def _size(datagram: Datagram) -> int:
    return len(datagram.payload) + _OVERHEAD_BYTES


def _megabytes(count: int) -> str:
    return f"{count / 1e6:,.0f} MB"
