"""The markers that model definitions describe, each with one unique name, and which marker ids are known to mean them.

Names are those of the definitions. Where two subjects have a marker of the same name, both are written
"subject:marker". The set "all" repeats the others and counts only when there is no other.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from retarget.udp.natnet.models import (
    AssetDescription,
    ModelDef,
    RigidBodyDescription,
    SkeletonDescription,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

EVERYTHING = "all"
"""The marker set in which Motive repeats the markers of all others."""
MAX_COLUMNS = 4096
"""Markers that one stream can have; the protocol itself allows no more in a datagram."""


@dataclass(slots=True)
class Subject:
    """One marker set, rigid body or asset: its columns in the order of its markers."""

    name: str
    first_column: int
    marker_names: tuple[str, ...]

    def column(self, index: int) -> int | None:
        """Column of the marker at `index`, counted from 0; None where there is no such marker."""
        return self.first_column + index if 0 <= index < len(self.marker_names) else None


@dataclass(slots=True)
class Catalogue:
    """All subjects; grows when a stream shows markers that nothing describes."""

    subjects: dict[str, Subject] = field(default_factory=dict)
    asset_subjects: dict[int, Subject] = field(default_factory=dict)
    """Subjects whose asset id the definitions give."""
    column_of_id: dict[int, int] = field(default_factory=dict)
    """Columns of markers whose full id the definitions give."""
    width: int = 0
    """Number of columns."""

    def add(self, name: str, marker_names: tuple[str, ...]) -> Subject:
        """Append a subject; one that does not fit any more is empty."""
        fitting = marker_names if self.width + len(marker_names) <= MAX_COLUMNS else ()
        subject = Subject(name, self.width, fitting)
        self.subjects[name] = subject
        self.width += len(fitting)
        return subject

    def column_names(self) -> tuple[str, ...]:
        """One unique name per column."""
        pairs = [(s.name, marker) for s in self.subjects.values() for marker in s.marker_names]
        often = Counter(marker for _, marker in pairs)
        return _unique(marker if often[marker] == 1 else f"{subject}:{marker}" for subject, marker in pairs)

    def unidentified(self, taken: set[str]) -> list[Subject]:
        """Subjects of which no asset id is known, apart from those named in `taken`."""
        known = {subject.name for subject in self.asset_subjects.values()} | taken
        return [subject for subject in self.subjects.values() if subject.name not in known and subject.marker_names]


def catalogue_of(definitions: ModelDef) -> Catalogue:
    """Collect what the definitions say about markers."""
    catalogue = Catalogue()
    sets = definitions.marker_sets
    for described in [s for s in sets if s.name != EVERYTHING] or list(sets):
        if described.name not in catalogue.subjects:
            catalogue.add(described.name, described.marker_names)
    for description in definitions.descriptions:
        match description:
            case RigidBodyDescription():
                _add_rigid_body(catalogue, description)
            case SkeletonDescription() if description.name in catalogue.subjects:
                catalogue.asset_subjects[description.id] = catalogue.subjects[description.name]
            case AssetDescription():
                _add_asset(catalogue, description)
            case _:
                pass
    return catalogue


def _add_rigid_body(catalogue: Catalogue, body: RigidBodyDescription) -> None:
    subject = catalogue.subjects.get(body.name)
    if subject is None and body.markers is not None:
        numbered = tuple(f"{body.name}_{i + 1}" for i in range(len(body.markers.positions)))
        subject = catalogue.add(body.name, body.markers.names or numbered)
    if subject is not None:
        catalogue.asset_subjects[body.id] = subject


def _add_asset(catalogue: Catalogue, asset: AssetDescription) -> None:
    """Map the ids of the asset's markers; they are written with or without the asset's own id in the upper half."""
    subject = catalogue.subjects.get(asset.name)
    if subject is None:
        subject = catalogue.add(asset.name, tuple(marker.name for marker in asset.markers))
    catalogue.asset_subjects[asset.id] = subject
    indices = {name: index for index, name in enumerate(subject.marker_names)}
    for marker in asset.markers:
        column = subject.column(indices.get(marker.name, -1))
        if column is not None:
            catalogue.column_of_id[asset.id << 16 | marker.id & 0xFFFF] = column


def _unique(names: Iterable[str]) -> tuple[str, ...]:
    """The same names, those that come again numbered: "chin", "chin_2"."""
    unique: dict[str, None] = {}
    times: Counter[str] = Counter()
    for name in names:
        candidate = name
        while candidate in unique:
            times[name] += 1
            candidate = f"{name}_{times[name] + 1}"
        unique[candidate] = None
    return tuple(unique)
