"""How the bones of a 2D skeleton turn: angles against their parents, in degrees, counter-clockwise as seen.

Two sets of rules. Video2Anim's: a bone's angle is taken against its parent's own angle, a full turn is added or taken
away once at most, and time is counted from the first detection only after it. Mended: against the parent's direction
in the picture, by as many turns as it takes, with one zero of time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.body2d.card import sides
from retarget.body2d.settings import Rules

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.body2d.card import Card
    from retarget.body2d.read import Recording
    from retarget.body2d.settings import Settings

    Array = NDArray[np.float64]

WIDE_SCREEN = (16.0, 9.0)
_LARGEST_PART = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Turns:
    """Angles of one person's bones."""

    times_s: Array
    """(F,), from the person's first detection."""
    angles_deg: Array
    """(F, B); NaN where the bone, or one that it hangs on, was not seen."""
    start_s: float
    """When the first detection was, in the film."""

    def seen(self, bone: int) -> tuple[Array, Array]:
        """Times (N,) and angles (N,) [deg] of `bone` where it was seen."""
        there = np.isfinite(self.angles_deg[:, bone])
        return self.times_s[there], self.angles_deg[there, bone]


def bone_turns(recording: Recording, person: int, card: Card, settings: Settings) -> Turns:
    """Measure `person`, whose number is below `recording.persons`."""
    points = recording.points[:, person]
    if settings.rules is Rules.VIDEO2ANIM:
        directions = _directions(points, card, settings.min_confidence, np.array([1.0, -1.0]))
        return _by_video2anim(np.arange(len(points)), directions, card, settings)
    directions = _directions(points, card, settings.min_confidence, picture_scale(recording, settings))
    return _mended(recording.frames, directions, card, settings)


def picture_scale(recording: Recording, settings: Settings) -> Array:
    """What x and y (2,) are multiplied by, so that lengths are equal both ways and +y is up."""
    if not given_as_parts(recording):
        return np.array([1.0, -1.0])
    width, height = settings.picture_size or WIDE_SCREEN
    return np.array([width / height, -1.0])


def given_as_parts(recording: Recording) -> bool:
    """True where no coordinate is beyond what a part of the picture can be, and so none is in pixels."""
    return bool(np.nanmax(np.abs(recording.points[..., :2]), initial=0.0) <= _LARGEST_PART)


def _directions(points: Array, card: Card, min_confidence: float, scale: Array) -> Array:
    """Direction (F, B) [deg] of each bone in the picture, NaN where an end was not seen."""
    seen = points[..., 2:] >= min_confidence
    places = np.where(seen, points[..., :2] * scale, np.nan)
    starts, ends = ([sides(p) for p in pair] for pair in zip(*((b.start, b.end) for b in card.bones), strict=True))
    along = places[:, np.array(ends)].mean(axis=2) - places[:, np.array(starts)].mean(axis=2)
    directions: Array = np.degrees(np.arctan2(along[..., 1], along[..., 0]))
    return directions


def _mended(frames: NDArray[np.intp], directions: Array, card: Card, settings: Settings) -> Turns:
    angles = np.full_like(directions, np.nan)
    for at, bone in enumerate(card.bones):
        against = settings.body_orientation if bone.parent < 0 else directions[:, bone.parent]
        turned = (directions[:, at] - against) % 360
        seen = np.isfinite(turned)
        angles[seen, at] = np.unwrap(turned[seen], period=360)
    first = _first_seen(angles)
    return Turns((frames - frames[first]) / settings.fps, angles, float(frames[first] / settings.fps))


def _by_video2anim(frames: NDArray[np.intp], directions: Array, card: Card, settings: Settings) -> Turns:
    angles = np.full_like(directions, np.nan)
    for at, bone in enumerate(card.bones):
        against = 0.0 if bone.parent < 0 else angles[:, bone.parent]
        turned = (directions[:, at] - settings.body_orientation % 360 - against) % 360
        seen = np.flatnonzero(np.isfinite(turned))
        angles[seen, at] = _nearest_within_a_turn(turned[seen])
    first = _first_seen(directions)
    period_s = 1 / settings.fps
    times_s = np.where(frames <= first, frames, frames - first) * period_s
    return Turns(times_s, angles, 0.0)


def _nearest_within_a_turn(turned: Array) -> Array:
    angles = turned.tolist()
    for i in range(1, len(angles)):
        before = angles[i - 1]
        angles[i] = min((angles[i], angles[i] + 360, angles[i] - 360), key=lambda angle: abs(angle - before))
    return np.array(angles)


def _first_seen(angles: Array) -> int:
    """The first frame in which any bone was seen, 0 where none ever was."""
    return int(np.argmax(np.isfinite(angles).any(axis=1)))
