"""Settings of the conversion, by the names that Video2Anim gave them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from retarget.errors import InputError


class Rules(Enum):
    """Whose rules hold."""

    MENDED = "mended"
    """Video2Anim's, without its faults."""
    VIDEO2ANIM = "video2anim"
    """Video2Anim's to the last key, time and value; the file that is written is sound all the same."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How key points become keys; each setting stands alone, in any order. Raises InputError for one out of range."""

    fps: float = 30.0
    """Pictures a second of the film that the key points come from."""
    body_orientation: float = 90.0
    """Direction [deg], counter-clockwise from the picture's right, of a root bone whose angle is 0."""
    min_confidence: float = 0.6
    """In [0, 1]: a point below it counts as not seen."""
    min_trembling_freq: float = 7.0
    """Extrema that follow each other faster than this [Hz] are dropped; 0 keeps all."""
    mlf_max_error_ratio: float = 0.1
    """In [0, 1]: how far a line may miss a key, as part of the bone's range; 0 keeps all keys."""
    avg_keys_per_sec: int = 0
    """At most so many keys a second, by averaging; 0 keeps all."""
    max_error_deg: float | None = None
    """Given, the three steps above give way to an error-bounded fit of the cubic curve that Unity evaluates [deg]."""
    picture_size: tuple[float, float] | None = None
    """Width and height of the picture, in any unit: needed where points are given as parts of it, as with OpenPose's
    --keypoint_scale 3; without it such a picture counts as 16:9.
    """
    rules: Rules = Rules.MENDED

    def __post_init__(self) -> None:
        _check("fps", self.fps, 0.0, 1e5, above=True)
        _check("body_orientation", self.body_orientation, -1e6, 1e6)
        _check("min_confidence", self.min_confidence, 0.0, 1.0)
        _check("min_trembling_freq", self.min_trembling_freq, 0.0, 1e5)
        _check("mlf_max_error_ratio", self.mlf_max_error_ratio, 0.0, 1.0)
        _check("avg_keys_per_sec", self.avg_keys_per_sec, 0, 1e5)
        if int(self.avg_keys_per_sec) != self.avg_keys_per_sec:
            raise InputError(f"avg_keys_per_sec is {self.avg_keys_per_sec:g}; it must be a whole number.")
        if self.max_error_deg is not None:
            _check("max_error_deg", self.max_error_deg, 0.0, 360.0, above=True)
        for side in self.picture_size or ():
            _check("picture_size", side, 0.0, 1e6, above=True)


def _check(name: str, value: float, least: float, most: float, *, above: bool = False) -> None:
    if not (math.isfinite(value) and least <= value <= most) or (above and value == least):
        rule = f"above {least:g} and up to {most:g}" if above else f"from {least:g} to {most:g}"
        raise InputError(f"{name} is {value:g}; it must be a number {rule}.")
