"""A file that grows by whole records or not at all."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Final

from retarget.errors import OutputError

if TYPE_CHECKING:
    from pathlib import Path

_FLAGS: Final = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)


class AppendFile:
    """A new file, written without a buffer of our own: what `append` returned from, a killed process cannot lose.

    Raises OutputError where the file exists or cannot be created.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._descriptor = os.open(path, _FLAGS, 0o666)
        except FileExistsError as error:
            raise OutputError(
                f"{path} exists, and a take is never overwritten: choose another name or remove it"
            ) from error
        except OSError as error:
            raise OutputError(
                f"{path} cannot be written: {error.strerror}. Check the folder and its permissions"
            ) from error
        self._size = 0

    def append(self, record: bytes) -> None:
        """Write all of `record`. Raises OSError, and then the file ends with the record before."""
        rest = memoryview(record)
        try:
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError:
            os.ftruncate(self._descriptor, self._size)
            os.lseek(self._descriptor, self._size, os.SEEK_SET)
            raise
        self._size += len(record)

    def sync(self) -> None:
        """Bring what is written to the disk. Raises OSError."""
        os.fsync(self._descriptor)

    def close(self) -> None:
        """Close the file; it must not be used afterwards."""
        os.close(self._descriptor)
