"""The sink `frames/`: a PNG file for every pose, named by its frame number."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

from retarget.errors import OutputError
from retarget.rig.display.offscreen import Offscreen
from retarget.rig.display.pictures import save_picture

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from types import TracebackType

    from retarget.frames import Pose
    from retarget.rig.display.view import View
    from retarget.rig.model import Rig
    from retarget.rig.skinning import Deformed


class FramesSink:
    """Writes frame 420 to `000420.png` in `folder`, which is made where it is missing.

    A number that comes again replaces its picture.
    """

    def __init__(
        self, folder: Path, rig: Rig, view: View | None = None, skin: Callable[[Pose], Deformed] | None = None
    ) -> None:
        """`view` and `skin` as for `Offscreen`."""
        self._folder = folder
        self._offscreen = Offscreen(rig, view, skin)

    def __enter__(self) -> Self:
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"Cannot make the folder {self._folder} for pictures: {error.strerror}.") from error
        self._offscreen.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._offscreen.close()

    def __call__(self, pose: Pose) -> None:
        """Draw the pose and write it; OutputError where the disk refuses."""
        save_picture(self._folder / f"{pose.number:06d}.png", self._offscreen.render(pose))
