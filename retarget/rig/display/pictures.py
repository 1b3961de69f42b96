"""Pictures as PNG files: exact, and never half written."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from retarget.errors import OutputError

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

COMPRESSION = 2
"""zlib's level: faces on a flat ground hardly shrink further, and a live run must keep up."""


def save_picture(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture (H, W, 3), sRGB, as PNG; OutputError where it cannot.

    Whoever watches the folder sees the whole file or none.
    """
    cv2 = import_module("cv2")
    _, encoded = cv2.imencode(".png", picture[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, COMPRESSION])
    partial = path.with_name(f".{path.name}.partial")
    try:
        partial.write_bytes(encoded)
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(f"Cannot write the picture {path}: {error.strerror or error}.") from error
