"""Layouts: which markers a face wears, what they are called, which rig site each drives, which carry the head's motion.

A layout is a card, a small TOML file; some come with the package and a user can write his own::

    version = 1
    name = "mine"
    description = "what it is"

    [markers]
    chin = { site = "chin", aliases = ["CHN"], rest = [0.0, -0.015, 0.09] }
    LFHD = { head = true }

`site` names the rig's joint and is left out for markers that drive none, `head` marks what moves with the skull alone,
`rest` [m] is a typical place in ``head``. Names are matched without regard to case, to spaces, ``_``, ``-`` and ``.``,
and to a subject in front, as in ``Ana:chin``.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from retarget.errors import InputError
from retarget.frames import MarkerLayout
from retarget.toml_table import read_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from retarget.toml_table import Table

VERSION = 1
MAX_MARKERS = 1000
LEAST_HEAD_MARKERS = 3
SHOWN_NAMES = 60
"""How many names an error spells out."""
CARDS = Path(__file__).parent / "layouts"


class Match(NamedTuple):
    """Where each marker of a layout stands among incoming names, and what fits nowhere."""

    at: tuple[int, ...]
    """(M,) positions among the incoming names, -1 where no name fits."""
    unmatched: tuple[int, ...]
    """Positions of the incoming names that no marker answers to."""


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """A card: the markers, and the other names that they go by."""

    markers: MarkerLayout
    aliases: tuple[tuple[str, ...], ...]
    """(M,), for each marker."""
    description: str
    source: Path

    @property
    def name(self) -> str:
        """The layout's name."""
        return self.markers.name

    def match(self, names: Sequence[str]) -> Match:
        """Find the layout's markers among `names`.

        Where several names fit one marker, as with two people in view, the subject with the most fitting markers has
        it, then the marker's own name before an alias, then the first.
        """
        own = {_key(name): i for i, name in enumerate(self.markers.names)}
        known = own | {_key(alias): i for i, aliases in enumerate(self.aliases) for alias in aliases}
        fitting = [(known[_key(name)], at) for at, name in enumerate(names) if _key(name) in known]
        subjects = Counter(_subject(names[at]) for _, at in fitting)
        fitting.sort(key=lambda fit: (-subjects[_subject(names[fit[1]])], _key(names[fit[1]]) not in own, fit[1]))
        index = [-1] * len(self.markers.names)
        for marker, at in fitting:
            if index[marker] < 0:
                index[marker] = at
        taken = set(index)
        return Match(tuple(index), tuple(at for at in range(len(names)) if at not in taken))

    def sites_in(self, names: Sequence[str]) -> int:
        """How many of the markers that drive the rig are among `names`."""
        return sum(at >= 0 and site != "" for at, site in zip(self.match(names).at, self.markers.sites, strict=True))


def available_layouts() -> tuple[str, ...]:
    """Names of the layouts that come with the package."""
    return tuple(sorted(path.stem for path in CARDS.glob("*.toml")))


def load_layout(name_or_path: str | Path) -> Layout:
    """The packaged layout of that name, or the card at that path.

    InputError where there is none, or the card has a mistake; it names the place.
    """
    if str(name_or_path) in available_layouts():
        return _read_card(CARDS / f"{name_or_path}.toml")
    path = Path(name_or_path)
    if path.suffix == ".toml" or path.exists():
        return _read_card(path)
    names = ", ".join(available_layouts())
    raise InputError(f"There is no layout {str(name_or_path)!r}; give one of {names}, or the path of a .toml file.")


def detect_layout(names: Sequence[str]) -> Layout:
    """The packaged layout of which most rig-driving markers are among `names`.

    InputError, listing the names seen and expected, where none fits or two fit equally well.
    """
    layouts = [load_layout(name) for name in available_layouts()]
    counts = [layout.sites_in(names) for layout in layouts]
    best = max(counts)
    fitting = [layout for layout, count in zip(layouts, counts, strict=True) if count == best]
    if best == 0:
        raise no_marker_known(names, layouts)
    if len(fitting) > 1:
        tied = " and ".join(layout.name for layout in fitting)
        raise InputError(f"The layouts {tied} fit the marker names equally well ({listed(names)}); choose one of them.")
    return fitting[0]


def no_marker_known(names: Sequence[str], layouts: Iterable[Layout]) -> InputError:
    """The error for marker names of which no layout knows any."""
    expected = "; ".join(f"{layout.name}: {listed(layout.markers.names)}" for layout in layouts)
    advice = "rename the markers, or write a layout that lists their names as aliases"
    return InputError(f"No marker is known. Seen: {listed(names)}. Expected: {expected}. To help, {advice}.")


def listed(names: Sequence[str]) -> str:
    """`names` for a message, the first of them where they are many."""
    if not names:
        return "no names at all"
    more = f" and {len(names) - SHOWN_NAMES} more" if len(names) > SHOWN_NAMES else ""
    return ", ".join(names[:SHOWN_NAMES]) + more


def _key(name: str) -> str:
    """What of a name is compared."""
    return name.rpartition(":")[2].casefold().translate({ord(c): None for c in " _-."})


def _subject(name: str) -> str:
    return name.rpartition(":")[0]


def _read_card(path: Path) -> Layout:
    card = read_table(path, "marker layout")
    card.only("version", "name", "description", "markers")
    if card.number("version") != VERSION:
        raise card.wrong("version", f"must be {VERSION}, the only version that this program reads")
    table = card.table("markers")
    if not 0 < len(table.values) <= MAX_MARKERS:
        raise card.wrong("markers", f"must list 1 to {MAX_MARKERS} markers")
    rows = [_Row.read(table, name) for name in table.values]
    _refuse_ambiguity(path, rows)
    head = tuple(i for i, row in enumerate(rows) if row.head)
    if len(head) < LEAST_HEAD_MARKERS:
        raise card.wrong("markers", f"must mark at least {LEAST_HEAD_MARKERS} with head = true, to follow the head")
    names, sites = tuple(row.name for row in rows), tuple(row.site for row in rows)
    rests = [row.rest for row in rows if row.rest is not None]
    rest = np.array([(np.nan,) * 3 if row.rest is None else row.rest for row in rows]) if rests else None
    description = card.string("description") if "description" in card.values else ""
    markers = MarkerLayout(card.string("name"), names, sites, head, rest)
    return Layout(markers, tuple(row.aliases for row in rows), description, path)


class _Row(NamedTuple):
    name: str
    site: str
    aliases: tuple[str, ...]
    head: bool
    rest: tuple[float, ...] | None

    @classmethod
    def read(cls, markers: Table, name: str) -> _Row:
        row = markers.table(name)
        row.only("site", "aliases", "head", "rest")
        head = row.values.get("head", False)
        if not isinstance(head, bool):
            raise row.wrong("head", "must be true or false")
        site = row.string("site") if "site" in row.values else ""
        aliases = row.strings("aliases") if "aliases" in row.values else ()
        rest = tuple(row.array("rest", (3,)).tolist()) if "rest" in row.values else None
        return cls(name, site, aliases, head, rest)


def _refuse_ambiguity(path: Path, rows: Sequence[_Row]) -> None:
    owners: dict[str, str] = {}
    for row in rows:
        for name in (row.name, *row.aliases):
            if not _key(name):
                raise InputError(f"{path}: {name!r} of marker {row.name!r} is no name: it has no letter or digit.")
            if owners.setdefault(_key(name), row.name) != row.name:
                other = owners[_key(name)]
                raise InputError(f"{path}: the markers {other!r} and {row.name!r} both answer to {name!r}.")
    for site, count in Counter(row.site for row in rows if row.site).items():
        if count > 1:
            raise InputError(f"{path}: {count} markers drive the site {site!r}; at most one may.")
