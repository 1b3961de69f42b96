"""A performer file that is edited while it is in use."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING

from retarget.errors import RetargetError
from retarget.performer import load_performer

if TYPE_CHECKING:
    from pathlib import Path

    from retarget.performer import Performer

log = logging.getLogger("retarget.performer")

LOOK_EVERY_S = 0.25


class PerformerWatch:
    """Looks at the file four times a second and tells of each new content that can be used.

    Content that cannot be used is reported once by the log, and nothing changes.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._stamp = self._stamp_now()
        self._looked_s = time.monotonic()

    def __call__(self) -> Performer | None:
        """The performer, if the file has changed since the last call; costs next to nothing between two looks."""
        now_s = time.monotonic()
        if now_s - self._looked_s < LOOK_EVERY_S:
            return None
        self._looked_s = now_s
        stamp = self._stamp_now()
        if stamp is None or stamp == self._stamp:  # an editor may remove the file for a moment
            return None
        self._stamp = stamp
        try:
            return load_performer(self._path)
        except RetargetError as error:
            log.warning("The performer stays as it was: %s", error)
            return None

    def _stamp_now(self) -> tuple[int, int, int] | None:
        try:
            status = self._path.stat()
        except OSError:
            return None
        return status.st_mtime_ns, status.st_size, status.st_ino
