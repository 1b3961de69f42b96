"""Pictures of a video file or of a folder: nothing is lost, and they are read as fast as they are wanted."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Self

import numpy as np

from retarget.camera.pictures import Picture
from retarget.camera.quiet import quiet
from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import cv2

PICTURE_ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")
RATE_HZ = 30.0
"""At which the pictures of a folder are taken to follow one another, and a film that does not tell its rate."""


class FilmPictures:
    """A video file."""

    live = False
    dropped = 0

    def __init__(self, path: Path) -> None:
        self._path = path
        self._capture: cv2.VideoCapture | None = None
        self._stopped = False

    @property
    def rate_hz(self) -> float:
        """The file's own rate [Hz]."""
        import cv2

        told = self._open().get(cv2.CAP_PROP_FPS)
        return told if np.isfinite(told) and told > 0 else RATE_HZ

    @property
    def count(self) -> int | None:
        """As the file tells."""
        import cv2

        return int(self._open().get(cv2.CAP_PROP_FRAME_COUNT)) or None

    def stop(self) -> None:
        """No picture after the current one."""
        self._stopped = True

    def __enter__(self) -> Self:
        if not self._path.is_file():
            raise InputError(f"There is no video file {self._path}.")
        import cv2

        with quiet():
            self._capture = cv2.VideoCapture(str(self._path))
        if not self._capture.isOpened():
            self._capture.release()
            raise InputError(f"{self._path} cannot be read as a video; is it whole, and does another player show it?")
        return self

    def __exit__(self, *_: object) -> None:
        self._open().release()

    def __iter__(self) -> Iterator[Picture]:
        import cv2

        capture, step_s, time_s = self._open(), 1.0 / self.rate_hz, 0.0
        number = 0
        while not self._stopped:
            found, image = capture.read()
            if not found:
                break
            told_s = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
            time_s = told_s if told_s > time_s else time_s + step_s * (number > 0)
            yield Picture(number, time_s, np.asarray(image, np.uint8))
            number += 1
        if number == 0 and not self._stopped:
            raise InputError(f"The video {self._path} holds no picture that can be read.")

    def _open(self) -> cv2.VideoCapture:
        if self._capture is None:
            raise InputError(f"{self._path} is not open; use it as a context manager.")
        return self._capture


class FolderPictures:
    """Pictures of a folder, in the order of the numbers in their names."""

    live = False
    dropped = 0
    rate_hz = RATE_HZ

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files: tuple[Path, ...] = ()
        self._stopped = False

    @property
    def count(self) -> int:
        """All of them."""
        return len(self._files)

    def stop(self) -> None:
        """No picture after the current one."""
        self._stopped = True

    def __enter__(self) -> Self:
        found = [path for path in self._folder.iterdir() if path.suffix.lower() in PICTURE_ENDINGS]
        if not found:
            raise InputError(f"The folder {self._folder} holds no picture ({', '.join(PICTURE_ENDINGS)}).")
        self._files = tuple(sorted(found, key=_by_number))
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def __iter__(self) -> Iterator[Picture]:
        import cv2

        for number, path in enumerate(self._files):
            if self._stopped:
                return
            image = cv2.imread(str(path), cv2.IMREAD_COLOR)
            if image is None:
                raise InputError(f"The picture {path} cannot be read; leave it out or save it again.")
            yield Picture(number, number / self.rate_hz, np.asarray(image, np.uint8))


def _by_number(path: Path) -> tuple[int, str]:
    """`frame_10` after `frame_9`, whatever the zeros."""
    numbers = re.findall(r"\d+", path.stem)
    return int(numbers[-1]) if numbers else -1, path.name
