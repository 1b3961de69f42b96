"""The sink `*.mp4`: a video with one picture for every pose.

MPEG-4 part 2 (`mp4v`) in 4:2:0, which OpenCV's wheels write everywhere; its flat green comes back one step off,
(0, 254, 0). Whoever needs the exact colour takes PNG files (`frames`).
"""

from __future__ import annotations

import math
import os
from importlib import import_module
from typing import TYPE_CHECKING, Any, Self

from retarget.errors import InputError, OutputError
from retarget.rig.display.offscreen import Offscreen

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from types import TracebackType

    from retarget.frames import Pose
    from retarget.rig.display.view import View
    from retarget.rig.model import Rig
    from retarget.rig.skinning import Deformed

FASTEST_HZ = 240.0


class Mp4Sink:
    """Writes every pose as one picture, `fps` pictures to the second.

    The file can be played once the `with` block is left, by an exception (Ctrl-C) as well. Leaving it without one
    raises OutputError where no pose came (no file stays then) or the file does not hold every picture.
    """

    def __init__(
        self,
        path: Path,
        rig: Rig,
        fps: float,
        view: View | None = None,
        skin: Callable[[Pose], Deformed] | None = None,
    ) -> None:
        """`view` and `skin` as for `Offscreen`; InputError where `fps` is no rate, or a side of the picture is odd."""
        if not (math.isfinite(fps) and 0 < fps <= FASTEST_HZ):
            raise InputError(
                f"A video cannot have {fps:g} pictures a second; it can have more than 0 and up to {FASTEST_HZ:g}."
            )
        self._path = path
        self._fps = fps
        self._offscreen = Offscreen(rig, view, skin)
        size = self._offscreen.view.width, self._offscreen.view.height
        if size[0] % 2 or size[1] % 2:
            raise InputError(f"A video of {size[0]}x{size[1]} pixels cannot be written; both sides must be even.")
        self._size = size
        self._writer: Any = None
        self._written = 0

    def __enter__(self) -> Self:
        _check_writable(self._path)
        try:
            self._offscreen.__enter__()
            self._writer = _open_writer(self._path, self._fps, self._size)
        except BaseException:
            self._offscreen.close()
            if not self._path.stat().st_size:
                self._path.unlink()
            raise
        return self

    def __call__(self, pose: Pose) -> None:
        """Draw the pose and append its picture."""
        self._writer.write(self._offscreen.render(pose)[..., ::-1])
        self._written += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.release()
        self._offscreen.close()
        if not self._written:
            self._path.unlink(missing_ok=True)
        if kind is None:
            self._check()

    def _check(self) -> None:
        if not self._written:
            raise OutputError(f"The video {self._path} was not written: not one pose reached it.")
        held = _pictures_in(self._path)
        if held != self._written:
            raise OutputError(f"The video {self._path} holds {held} of {self._written} pictures; is the disk full?")


def _open_writer(path: Path, fps: float, size: tuple[int, int]) -> Any:
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # FFmpeg's own lines on stderr would hide our sentence
    cv2 = import_module("cv2")
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), fps, size)
    if not writer.isOpened():
        raise OutputError(f"OpenCV cannot start the video {path}; its build on this machine lacks MPEG-4 (mp4v).")
    return writer


def _check_writable(path: Path) -> None:
    try:
        with path.open("ab"):
            pass
    except OSError as error:
        raise OutputError(f"Cannot write the video {path}: {error.strerror}.") from error


def _pictures_in(path: Path) -> int:
    cv2 = import_module("cv2")
    video = cv2.VideoCapture(str(path))
    count = int(video.get(cv2.CAP_PROP_FRAME_COUNT)) if video.isOpened() else 0
    video.release()
    return count
