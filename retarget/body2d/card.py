"""Cards of 2D rigs: which points a detector gives, and which bones lie between them.

A small TOML file; `body25` comes with the package, see `cards/body25.toml` for its form. A bone runs ``from`` one
point ``to`` another, given by name or number; a number with a half is the middle of the points on both sides of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from retarget.errors import InputError
from retarget.toml_table import read_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from retarget.toml_table import Table

VERSION = 1
CARDS = Path(__file__).parent / "cards"


@dataclass(frozen=True, slots=True)
class Bone:
    """A bone of the skeleton."""

    name: str
    start: float
    """Number of the point it begins at; with a half, the middle of two."""
    end: float
    parent: int
    """Which bone of the card it hangs on, -1 for none."""
    path: str
    """Its place in the animated object, as Unity writes it."""


@dataclass(frozen=True, slots=True)
class Card:
    """A 2D rig; parents stand before their children."""

    name: str
    points: tuple[str, ...]
    bones: tuple[Bone, ...]


def load_card(rig: str | Path) -> Card:
    """The card of that name that comes with the package, or the one at that path. Raises InputError."""
    known = sorted(path.stem for path in CARDS.glob("*.toml"))
    if str(rig) in known:
        return _read(CARDS / f"{rig}.toml")
    path = Path(rig)
    if not path.is_file():
        raise InputError(f"There is no 2D rig {str(rig)!r}: give the path of a card, or one of {', '.join(known)}.")
    return _read(path)


def card_of_definitions(name: str, points: Sequence[str], bones_defs: Sequence[tuple[float, float, int, str]]) -> Card:
    """A card from definitions as Video2Anim has them: from, to, parent (-1 for none), path; in any order."""
    bones = tuple(Bone(path or str(i), float(a), float(b), p, path) for i, (a, b, p, path) in enumerate(bones_defs))
    for bone in bones:
        _check(bone, len(points), len(bones), name)
    return Card(name, tuple(points), _parents_first(bones, name))


def _read(path: Path) -> Card:
    root = read_table(path, "card of a 2D rig")
    root.only("version", "name", "description", "points", "bones")
    if root.number("version") != VERSION:
        raise root.wrong("version", f"must be {VERSION}")
    points = root.strings("points")
    table = root.table("bones")
    names = list(table.values)
    if not names:
        raise root.wrong("bones", "must hold at least one bone")
    bones = tuple(_bone(table, name, points, names) for name in names)
    for bone in bones:
        _check(bone, len(points), len(bones), str(path))
    return Card(root.string("name"), points, _parents_first(bones, str(path)))


def _bone(table: Table, name: str, points: tuple[str, ...], names: list[str]) -> Bone:
    entry = table.table(name)
    entry.only("from", "to", "parent", "path")
    parent = entry.string("parent") if "parent" in entry.values else None
    if parent is not None and parent not in names:
        raise entry.wrong("parent", f"must be another bone, one of {', '.join(names)}")
    ends = [_point(entry, key, points) for key in ("from", "to")]
    return Bone(name, ends[0], ends[1], -1 if parent is None else names.index(parent), entry.string("path"))


def _point(entry: Table, key: str, points: tuple[str, ...]) -> float:
    value = entry.get(key)
    if isinstance(value, str):
        if value not in points:
            raise entry.wrong(key, f"must be a point, one of {', '.join(points)}")
        return float(points.index(value))
    return entry.number(key)


def _check(bone: Bone, points: int, bones: int, place: str) -> None:
    for end in (bone.start, bone.end):
        if not (0 <= end <= points - 1 and (2 * end).is_integer()):
            raise InputError(
                f"{place}: the bone {bone.name!r} uses point {end:g}; points are 0 to {points - 1}, in halves."
            )
    if bone.start == bone.end:
        raise InputError(f"{place}: the bone {bone.name!r} begins and ends at the same point; give it two.")
    if not -1 <= bone.parent < bones:
        raise InputError(f"{place}: the bone {bone.name!r} has parent {bone.parent}; bones are 0 to {bones - 1}.")


def _parents_first(bones: tuple[Bone, ...], place: str) -> tuple[Bone, ...]:
    order: list[int] = []
    while len(order) < len(bones):
        ready = [i for i, b in enumerate(bones) if i not in order and (b.parent < 0 or b.parent in order)]
        if not ready:
            ring = next(b.name for i, b in enumerate(bones) if i not in order)
            raise InputError(f"{place}: the bone {ring!r} hangs on itself through its parents; let one have no parent.")
        order.append(ready[0])
    new = {old: at for at, old in enumerate(order)}
    return tuple(Bone(b.name, b.start, b.end, new.get(b.parent, -1), b.path) for b in (bones[old] for old in order))


def sides(point: float) -> tuple[int, int]:
    """The two points whose middle is `point`; twice the same where it is whole."""
    return math.floor(point), math.ceil(point)
