"""Pictures of the 2D skeleton: as a film, or as one picture of its stances over time.

Pixels of the picture that is drawn; people are told apart by colour. Points that were not seen are not drawn.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget.body2d.card import sides
from retarget.body2d.turns import picture_scale
from retarget.errors import InputError, OutputError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from retarget.body2d.card import Card
    from retarget.body2d.read import Recording
    from retarget.body2d.settings import Settings

    Array = NDArray[np.float64]
    Picture = NDArray[np.uint8]

FILM_SIZE = (640, 360)
STANCES = 8
_MARGIN = 0.06
_BACKGROUND = (24, 24, 24)
_COLOURS = ((90, 190, 255), (255, 180, 90), (140, 230, 140), (200, 140, 255))
"""BGR, as OpenCV has it."""


def write_film(path: Path, recording: Recording, card: Card, settings: Settings) -> int:
    """Write an MP4 at the film's own rate, everybody in it; returns its pictures. Raises OutputError."""
    cv2 = import_module("cv2")
    places = _places(recording, settings, FILM_SIZE)
    _make_folder(path)
    film = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), settings.fps, FILM_SIZE)
    if not film.isOpened():
        raise OutputError(f"The video {path} cannot be written: choose another place that ends in .mp4.")
    shown = np.searchsorted(recording.frames, np.arange(recording.frames[-1] + 1), side="right") - 1
    for at in shown.tolist():
        film.write(draw(places[at], card, settings.min_confidence, FILM_SIZE))
    film.release()
    return len(shown)


def write_picture(path: Path, recording: Recording, card: Card, settings: Settings, stances: int = STANCES) -> None:
    """Write one picture with `stances` moments of the film side by side. Raises OutputError, InputError."""
    if stances < 1:
        raise InputError(f"A picture of {stances} stances shows nothing: ask for one at least.")
    size = FILM_SIZE[0] // 2, FILM_SIZE[1]
    places = _places(recording, settings, size)
    moments = np.unique(np.linspace(0, len(places) - 1, stances).round().astype(int))
    drawn = [draw(places[at], card, settings.min_confidence, size) for at in moments.tolist()]
    _make_folder(path)
    done, data = import_module("cv2").imencode(".png", np.concatenate(drawn, axis=1))
    try:
        path.write_bytes(data.tobytes())
    except OSError as error:
        raise OutputError(f"The picture {path} cannot be written ({error.strerror}): choose another place.") from None
    if not done:
        raise OutputError(f"The picture {path} could not be encoded as PNG.")


def draw(places: Array, card: Card, min_confidence: float, size: tuple[int, int]) -> Picture:
    """Everybody's bones, `places` (persons, K, 3) in pixels with confidence, as a picture (height, width, 3) BGR."""
    cv2 = import_module("cv2")
    picture = np.full((size[1], size[0], 3), _BACKGROUND, np.uint8)
    for person, points in enumerate(places):
        colour = _COLOURS[person % len(_COLOURS)]
        seen = np.where(points[:, 2:] >= min_confidence, points[:, :2], np.nan)
        for bone in card.bones:
            _draw_bone(cv2, picture, seen, (bone.start, bone.end), colour)
    return picture


def _make_folder(path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"The folder of {path} cannot be made ({error.strerror}): choose another place.") from None


def _draw_bone(cv2: Any, picture: Picture, seen: Array, ends: tuple[float, float], colour: Sequence[int]) -> None:
    middle = np.array([seen[list(sides(end))].mean(axis=0) for end in ends])
    if not np.isfinite(middle).all():
        return
    start, end = (tuple(int(v) for v in point.round().clip(-10_000, 10_000)) for point in middle)
    cv2.line(picture, start, end, colour, 3, cv2.LINE_AA)
    for joint in (start, end):
        cv2.circle(picture, joint, 4, (240, 240, 240), -1, cv2.LINE_AA)


def _places(recording: Recording, settings: Settings, size: tuple[int, int]) -> Array:
    """All points (F, persons, K, 3) in pixels of a picture of `size`, into which everything seen fits."""
    points = recording.points.copy()
    points[..., :2] *= np.abs(picture_scale(recording, settings))
    seen = points[points[..., 2] >= settings.min_confidence][:, :2]
    if not len(seen):
        raise InputError(f"No point in {recording.source} is as sure as min_confidence {settings.min_confidence:g}.")
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = np.array(size) * (1 - 2 * _MARGIN)
    scale = float((room / np.maximum(high - low, 1e-9)).min())
    points[..., :2] = (points[..., :2] - (low + high) / 2) * scale + np.array(size) / 2
    return points
