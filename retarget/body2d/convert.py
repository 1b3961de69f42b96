"""From a folder of OpenPose's key points to Unity clips: Video2Anim's processing, and its faults mended.

What is mended by default is told by `MENDED`; `Rules.VIDEO2ANIM` gives that program's keys, times and values back.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from typing import TYPE_CHECKING

import numpy as np

from retarget.body2d.read import read_poses
from retarget.body2d.settings import Rules, Settings
from retarget.body2d.turns import bone_turns, given_as_parts
from retarget.errors import InputError
from retarget.export.keys import (
    Curve,
    KeyReport,
    average_keys,
    fit_curves,
    line_keys,
    report_keys,
    smooth_curve,
    steady_keys,
)
from retarget.export.unity_anim import BoneCurve, Clip, write_clip

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from retarget.body2d.card import Card
    from retarget.body2d.read import Recording

    Array = NDArray[np.float64]

MENDED = (
    "editor curves are filled",
    "missing folders of the output are made",
    "bones may be listed in any order",
    "every setting stands alone and is checked",
    "a bone seen once has one key, a bone never seen is left out and named",
    "pictures are taken in the order of their numbers",
    "all times count from the first detection",
    "times are exact, so no two keys fall together at any rate",
    "angles are measured in a picture of the right proportions",
    "any number of turns is unwrapped",
    "bindings carry the hash of the bone's own path",
    "settings may be given in any order",
    "a bone turns against its parent's direction, however deep it hangs",
)
"""What the default does otherwise than Video2Anim: its twelve known faults, and one more."""


@dataclass(frozen=True, slots=True, eq=False)
class Converted:
    """One person's animation and what became of the record."""

    person: int
    clip: Clip
    report: KeyReport
    """Keys before and after, largest error [deg]."""
    start_s: float
    """Where in the film the clip begins."""
    notes: tuple[str, ...]
    """What the user should know, a sentence each."""


def convert(poses_dir: Path, settings: Settings, card: Card, person: int, out: Path) -> Converted:
    """Write the animation of `person` to `out`. Raises InputError and OutputError."""
    converted = animate(read_poses(poses_dir, len(card.points)), settings, card, person, out.stem)
    write_clip(out, converted.clip)
    return converted


def convert_persons(
    poses_dir: Path, settings: Settings, card: Card, out: Path, *, persons: Sequence[int] = (), workers: int = 2
) -> list[Converted]:
    """Write the animation of each of `persons`, by default of everybody, to `<out>_<person>.anim`; in `workers`
    processes. As `convert`.
    """
    recording = read_poses(poses_dir, len(card.points))
    wanted = tuple(dict.fromkeys(persons)) or tuple(range(recording.persons))
    one = partial(_animate_to, recording, settings, card, out)
    if workers < 2 or len(wanted) < 2:
        return [one(person) for person in wanted]
    # a fresh process: a fork would copy the locks of whatever threads run here
    with ProcessPoolExecutor(min(workers, len(wanted)), mp_context=get_context("spawn")) as pool:
        return list(pool.map(one, wanted))


def animate(recording: Recording, settings: Settings, card: Card, person: int, name: str) -> Converted:
    """The animation of `person`, called `name`. Raises InputError where the person or all bones are never seen."""
    if not 0 <= person < recording.persons:
        raise InputError(
            f"There is no person {person} in {recording.source}; people are numbered 0 to {recording.persons - 1}."
        )
    turns = bone_turns(recording, person, card, settings)
    recorded = [turns.seen(bone) for bone in range(len(card.bones))]
    seen = [at for at, (times_s, _) in enumerate(recorded) if _enough(len(times_s), card.bones[at].name, settings)]
    if not seen:
        raise InputError(
            f"No bone of {card.name!r} was ever seen of person {person} in {recording.source}: "
            f"lower min_confidence, now {settings.min_confidence:g}, or choose another person."
        )
    curves = [_reduced(*recorded[at], settings) for at in seen]
    bones = [BoneCurve(card.bones[at].path, "euler", _about_z(curve)) for at, curve in zip(seen, curves, strict=True)]
    stop_s = max(float(recorded[at][0][-1]) for at in seen)
    rows = [(recorded[at][0], recorded[at][1][:, None]) for at in seen]
    report = report_keys(f"person {person}", "degrees", rows, curves)
    notes = _notes(recording, settings, card, seen)
    return Converted(person, Clip(name, bones, stop_s=stop_s), report, turns.start_s, notes)


def _animate_to(recording: Recording, settings: Settings, card: Card, out: Path, person: int) -> Converted:
    path = out.with_name(f"{out.stem}_{person}.anim")
    converted = animate(recording, settings, card, person, path.stem)
    write_clip(path, converted.clip)
    return converted


def _enough(keys: int, bone: str, settings: Settings) -> bool:
    if keys == 1 and settings.rules is Rules.VIDEO2ANIM:
        raise InputError(
            f"The bone {bone!r} was seen in one picture only, which Video2Anim's rules cannot take: "
            "use the mended rules, or lower min_confidence."
        )
    return keys > 0


def _reduced(times_s: Array, angles: Array, settings: Settings) -> Curve:
    if settings.max_error_deg is not None:
        return fit_curves(times_s, angles[None, :, None], settings.max_error_deg)[0]
    steady = steady_keys(times_s, angles, settings.min_trembling_freq)
    times_s, angles = times_s[steady], angles[steady]
    if settings.mlf_max_error_ratio > 0:
        kept = line_keys(times_s, angles[:, None], float(np.ptp(angles)) * settings.mlf_max_error_ratio)
        times_s, angles = times_s[kept], angles[kept]
    times_s, angles = average_keys(times_s, angles, int(settings.avg_keys_per_sec))
    return smooth_curve(times_s, angles[:, None])


def _about_z(curve: Curve) -> Curve:
    z = np.array([[0.0, 0.0, 1.0]])
    return Curve(curve.times_s, curve.values * z, curve.in_slopes * z, curve.out_slopes * z)


def _notes(recording: Recording, settings: Settings, card: Card, seen: list[int]) -> tuple[str, ...]:
    notes = []
    missing = [bone.name for at, bone in enumerate(card.bones) if at not in seen]
    if missing:
        notes.append(f"Never seen, and so left out: {', '.join(missing)}.")
    if settings.rules is Rules.VIDEO2ANIM:
        return (*notes, "By Video2Anim's rules: its keys, times and values.")
    if given_as_parts(recording) and settings.picture_size is None:
        notes.append("Points are parts of a picture of unknown size, taken as 16:9; picture_size says otherwise.")
    return (*notes, f"Otherwise than Video2Anim: {'; '.join(MENDED)}.")
