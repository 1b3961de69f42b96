"""Words on a picture."""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

MARGIN = 10
"""[pixel], of the text from its panel's edge and of the panel from the picture's."""


def with_text(picture: NDArray[np.uint8], text: str, size: int = 15) -> NDArray[np.uint8]:
    """The picture (H, W, 3) again with `text` on a dark panel in its upper left corner, letters of `size` pixels."""
    drawing, image = import_module("PIL.ImageDraw"), import_module("PIL.Image")
    canvas = image.fromarray(picture)
    draw = drawing.Draw(canvas, "RGBA")
    left, top, right, bottom = draw.multiline_textbbox((2 * MARGIN, 2 * MARGIN), text, font=_font(size))
    draw.rectangle((left - MARGIN, top - MARGIN, right + MARGIN, bottom + MARGIN), fill=(0, 0, 0, 170))
    draw.multiline_text((2 * MARGIN, 2 * MARGIN), text, font=_font(size), fill=(255, 255, 255))
    return np.asarray(canvas)


@lru_cache(maxsize=4)
def _font(size: int) -> Any:
    return import_module("PIL.ImageFont").load_default(size)
