"""Where pictures come from: a camera, a video file, or a folder of pictures.

``camera:0`` is the first camera. Pictures are (H, W, 3) BGR, as OpenCV has them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Self

from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

FILM_ENDINGS = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg")


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One picture and its instant."""

    number: int
    time_s: float
    """The film's own time; local monotonic time for a camera [s]."""
    image: NDArray[np.uint8]
    """(H, W, 3) BGR."""


class Pictures(Protocol):
    """Pictures in order; a context manager."""

    @property
    def live(self) -> bool:
        """True for a camera."""

    @property
    def rate_hz(self) -> float | None:
        """Pictures a second, once open; None if nobody tells."""

    @property
    def count(self) -> int | None:
        """How many there will be; None if nobody knows."""

    @property
    def dropped(self) -> int:
        """Pictures that were overtaken by newer ones before anybody looked."""

    def stop(self) -> None:
        """End the iteration soon; may be called from another thread or from a signal's function."""

    def __enter__(self) -> Self:
        """Open it; RetargetError where that fails."""

    def __exit__(self, *_: object) -> None:
        """Close it."""

    def __iter__(self) -> Iterator[Picture]:
        """The pictures."""


def open_pictures(where: str) -> Pictures:
    """Those of ``camera:N``, of a video file or of a folder, not yet open; InputError for anything else."""
    from retarget.camera.files import FilmPictures, FolderPictures
    from retarget.camera.live import CameraPictures

    camera = re.fullmatch(r"camera:(\d{1,3})", where)
    if camera:
        return CameraPictures(int(camera[1]))
    path = Path(where)
    if path.is_dir():
        return FolderPictures(path)
    if path.suffix.lower() in FILM_ENDINGS:
        return FilmPictures(path)
    raise InputError(f"{where!r} is no source of pictures; give camera:0, a video file or a folder of pictures.")
