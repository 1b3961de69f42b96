"""From where, how large and on what ground the face is drawn. Values only; `camera` turns them into a camera.

Angles in radians, sizes in pixels, colours in sRGB.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from retarget.errors import InputError

Framing = Literal["face", "head", "bust"]
Shading = Literal["auto", "vertex", "pixel"]

LARGEST_SIDE = 8192
"""[pixel], of the picture that the renderer draws, supersampling included; OpenGL 4.1 drivers offer twice that."""


@dataclass(frozen=True, slots=True)
class View:
    """How a picture is taken; raises InputError where a value cannot be drawn."""

    width: int = 640
    """[pixel]"""
    height: int = 480
    """[pixel]"""
    background: tuple[int, int, int] = (0, 255, 0)
    """sRGB bytes; it comes out exactly so, ready for chroma keying."""
    framing: Framing = "head"
    """What fills the picture: the face from brows to chin, the head, or the head with neck and shoulders, if any."""
    yaw_rad: float = 0.0
    """How far the camera walks round to the character's left; at 0 it stands before the face."""
    pitch_rad: float = 0.0
    """How far the camera climbs, between -pi/2 and pi/2."""
    zoom: float = 1.0
    """How much nearer than the framing asks: 2 doubles the size."""
    supersampling: int = 2
    """Every pixel is the mean of this many squared; 1 is fastest and leaves stairs on the edges."""
    shading: Shading = "auto"
    """Where light is computed: `vertex` in numpy, fast without a graphics card; `pixel` on the card; `auto` looks."""

    def __post_init__(self) -> None:
        _check_choice("framing", self.framing, get_args(Framing))
        _check_choice("shading", self.shading, get_args(Shading))
        if not (1 <= self.supersampling <= 4):
            raise InputError(f"supersampling is {self.supersampling}; it goes from 1 to 4.")
        largest = LARGEST_SIDE // self.supersampling
        if not (16 <= self.width <= largest and 16 <= self.height <= largest):
            raise InputError(
                f"Cannot draw a picture of {self.width}x{self.height} pixels with supersampling {self.supersampling}; "
                f"each side goes from 16 to {largest}."
            )
        if not all(0 <= c <= 255 for c in self.background):
            raise InputError(f"background is {self.background}; it takes red, green and blue, each from 0 to 255.")
        if not (0.1 <= self.zoom <= 20):
            raise InputError(f"zoom is {self.zoom:g}; it goes from 0.1 to 20.")
        if not abs(self.pitch_rad) < 1.5707 or not abs(self.yaw_rad) < 100:
            raise InputError("The camera's pitch must stay under a quarter turn, and its yaw must be a number.")


def _check_choice(what: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise InputError(f"{what} is {value!r}; it can be {', '.join(allowed)}.")
