"""Marker takes as C3D files, written with ezc3d: names, millimetres, rate, first frame, gaps.

A marker that was not seen stands at (0, 0, 0) with the residual -1; POINT:X_SCREEN and Y_SCREEN tell that +Y is up.
Source: The C3D File Format User Guide (c3d.org).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from retarget.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from retarget.markers.clip import MarkerClip

MAX_FRAMES: Final = 65_535
"""A C3D header counts frames in two bytes."""
NAMES_PER_PARAMETER: Final = 255
"""A C3D parameter counts its entries in one byte; further names go to LABELS2, LABELS3 ..."""


def write_c3d(path: Path, clip: MarkerClip) -> None:
    """Write `clip`. Positions are kept to float32 in millimetres; the first frame is 1 where its number is too large.

    Raises InputError for more than `MAX_FRAMES` frames, OSError where `path` cannot be written.
    """
    import ezc3d

    if len(clip) > MAX_FRAMES:
        raise InputError(f"{len(clip)} frames do not fit into a C3D file, which holds {MAX_FRAMES}; write .trc or .csv")
    with path.open("wb"):
        pass  # the library does not say why it cannot write
    content = ezc3d.c3d()
    _set_parameters(content["parameters"], clip)
    seen = np.isfinite(clip.positions.transpose(2, 1, 0)).all(axis=0, keepdims=True)  # (1, M, N)
    points = np.ones((4, len(clip.layout.names), len(clip)))
    points[:3] = np.where(seen, clip.positions.transpose(2, 1, 0) * 1e3, 0.0)
    content["data"]["points"] = points
    content["data"]["meta_points"]["residuals"] = np.where(seen, 0.0, -1.0)
    content["data"]["meta_points"]["camera_masks"] = np.zeros((7, *seen.shape[1:]), bool)
    content["header"]["points"]["first_frame"] = clip.first_frame - 1 if keeps_first_frame(clip) else 0
    content.write(str(path))


def keeps_first_frame(clip: MarkerClip) -> bool:
    """Whether a C3D header has room for the numbers of all frames."""
    return 1 <= clip.first_frame <= MAX_FRAMES - len(clip) + 1


def _set_parameters(parameters: Any, clip: MarkerClip) -> None:
    point = parameters["POINT"]
    point["RATE"]["value"] = [clip.rate_hz]
    point["UNITS"]["value"] = ["mm"]
    names = clip.layout.names
    for number, start in enumerate(range(0, len(names), NAMES_PER_PARAMETER), start=1):
        suffix = "" if number == 1 else str(number)
        some = names[start : start + NAMES_PER_PARAMETER]
        _set_text(point, f"LABELS{suffix}", some)
        _set_text(point, f"DESCRIPTIONS{suffix}", ("",) * len(some))
    _set_text(point, "X_SCREEN", ("+X",))
    _set_text(point, "Y_SCREEN", ("+Y",))


def _set_text(group: Any, name: str, values: tuple[str, ...]) -> None:
    """Type -1 is text."""
    group[name] = {"type": -1, "description": "", "is_locked": False, "value": list(values)}
