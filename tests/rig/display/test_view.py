"""A view takes what can be drawn and refuses the rest in one sentence."""

from __future__ import annotations

from typing import Any

import pytest

from retarget.errors import InputError
from retarget.rig.display.view import View


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ({"width": 0}, "each side"),
        ({"height": -480}, "each side"),
        ({"width": 5000, "supersampling": 2}, "4096"),
        ({"supersampling": 0}, "from 1 to 4"),
        ({"background": (0, 256, 0)}, "from 0 to 255"),
        ({"framing": "feet"}, "face, head, bust"),
        ({"shading": "flat"}, "auto, vertex, pixel"),
        ({"zoom": float("nan")}, "zoom"),
        ({"pitch_rad": 1.6}, "quarter turn"),
        ({"yaw_rad": float("nan")}, "number"),
    ],
)
def test_a_view_that_cannot_be_drawn_is_refused(values: dict[str, Any], word: str) -> None:
    with pytest.raises(InputError, match=word):
        View(**values)


def test_the_background_is_chroma_green_unless_told() -> None:
    assert View().background == (0, 255, 0)
