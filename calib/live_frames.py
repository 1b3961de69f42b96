"""Frames of a live source, gathered while a prompt lasts; between prompts they come and go."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Self

from retarget.errors import ConnectionFailedError, RetargetError

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from retarget.frames import MarkerFrame
    from retarget.sources import Source

SILENCE_S = 5.0
"""A source that sends nothing for so long has gone."""


class LiveFrames:
    """A context manager that opens a source and gathers its frames in a thread."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._frames: list[MarkerFrame] = []
        self._changed = threading.Condition()
        self._gathering = False
        self._ended = False
        self._failure: RetargetError | None = None
        self._thread = threading.Thread(target=self._gather, name="live frames", daemon=True)

    def __enter__(self) -> Self:
        self._source.__enter__()
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._source.stop()
        self._thread.join()
        self._source.__exit__(kind, error, trace)

    def gather(self, seconds: float, on_frame: Callable[[float], None] = lambda _: None) -> list[MarkerFrame]:
        """The frames of the next `seconds`, by their own clock; `on_frame` is told the part that is done.

        ConnectionFailedError where the source ends before, or falls silent.
        """
        with self._changed:
            self._frames = []
            self._gathering = True
        done = 0.0
        while done < 1.0:
            frames = self._next(SILENCE_S)
            done = (frames[-1].time_s - frames[0].time_s) / seconds
            on_frame(min(done, 1.0))
        with self._changed:
            self._gathering = False
        return frames

    def _next(self, patience_s: float) -> list[MarkerFrame]:
        """All frames of this gathering, as soon as there is a new one."""
        with self._changed:
            known = len(self._frames)

            def more() -> bool:
                return len(self._frames) > known or self._ended

            if not self._changed.wait_for(more, patience_s) or self._ended:
                if self._failure is not None:
                    raise self._failure
                raise ConnectionFailedError("The live source has ended or fallen silent; start it and repeat.")
            return list(self._frames)

    def _gather(self) -> None:
        try:
            for frame in self._source:
                with self._changed:
                    if self._gathering:
                        self._frames.append(frame)
                        self._changed.notify_all()
        except RetargetError as error:
            self._failure = error
        finally:
            with self._changed:
                self._ended = True
                self._changed.notify_all()
