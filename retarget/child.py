"""A sink in a process of its own: drawing and encoding then take no time from the receiver, and survive it.

The child reads poses from a pipe and closes its sink when the pipe ends, also when this process was killed; a film is
then whole up to its last picture.
"""

from __future__ import annotations

import multiprocessing
import signal
from typing import TYPE_CHECKING

from retarget.errors import RetargetError

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager
    from multiprocessing.connection import Connection
    from types import TracebackType

    from retarget.frames import Pose
    from retarget.outlets import Sink

_OPENED = "opened"
_CLOSED = "closed"


class ChildSink:
    """A sink whose work is done by another process. `opener` and `arguments` travel there, so they have to be
    picklable.
    """

    def __init__(self, opener: Callable[..., AbstractContextManager[Sink]], *arguments: object) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, self._far_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(self._far_end, opener, arguments), daemon=True)

    def __enter__(self) -> ChildSink:
        self._process.start()
        self._far_end.close()
        self._expect(_OPENED)
        return self

    def __call__(self, pose: Pose) -> None:
        """Hand over one pose."""
        try:
            self._pipe.send(pose)
        except OSError:
            self._expect(_CLOSED)  # raises what the child says of its end
            raise RetargetError("The process that draws ended early.") from None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._pipe.send(None)
                self._expect(_CLOSED)
        except OSError:
            self._expect(_CLOSED)
        finally:
            self._pipe.close()
            self._process.join()

    def _expect(self, word: str) -> None:
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError):
            self._process.join()
            raise RetargetError(f"The process that draws ended early (exit status {self._process.exitcode}).") from None
        if isinstance(answer, RetargetError):
            raise answer
        if answer != word:
            raise RetargetError(f"The process that draws answered {answer!r}, where {word!r} was due.")


def _serve(
    pipe: Connection, opener: Callable[..., AbstractContextManager[Sink]], arguments: tuple[object, ...]
) -> None:
    for interrupt in (signal.SIGINT, signal.SIGTERM):
        signal.signal(interrupt, signal.SIG_IGN)  # the parent decides when it is over, and says so by the pipe
    try:
        with opener(*arguments) as sink:
            pipe.send(_OPENED)
            _take_poses(pipe, sink)
        pipe.send(_CLOSED)
    except RetargetError as error:
        pipe.send(error)
    except BrokenPipeError:
        pass  # the parent is gone, and the sink is closed


def _take_poses(pipe: Connection, sink: Sink) -> None:
    while True:
        try:
            pose = pipe.recv()
        except EOFError:
            return
        if pose is None:
            return
        sink(pose)
