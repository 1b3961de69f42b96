"""Frames of data to named marker positions.

How a marker's name is found, the first that applies:

1. A labelled marker's id is ``asset id << 16 | member id``. Where a definition gives the asset id (rigid bodies,
   skeletons, trained assets), the member id, counted from 1, is the index into its marker names.
2. A marker set's definition has no id. But a frame repeats each set's positions in the order of the definition: the set
   that holds the asset's own positions at its member ids is the asset's. What was found so is kept.
3. Where no position decides (the set is not repeated, or nothing was seen yet), the only set with room for the member
   ids is taken for the moment.
4. A marker of no asset (ids of 2.5, and point-cloud ids) has the name of the set's marker at the very same position.
5. An asset that nothing describes gives ``id_<asset>_<member>``, an active marker ``active_<id>``; everything else is
   an unlabelled point: its id changes after each loss and would be a new name every time.

A set without labelled markers is read from the frame's marker sets, where exactly (0, 0, 0) means not seen. Labelled
markers are seen unless flagged as occluded or model-filled, or their residual is negative or not a number; those of 2.5
have no flags, and there (0, 0, 0) means not seen too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.frames import MarkerLayout
from retarget.udp.natnet.catalogue import EVERYTHING, Catalogue, Subject, catalogue_of
from retarget.udp.natnet.records import MarkerFlag

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from retarget.udp.natnet.framedata import FrameOfData, LabelledMarkers
    from retarget.udp.natnet.models import ModelDef

_NO_COLUMN = -1
_MEMBER = 0xFFFF


@dataclass(frozen=True, slots=True, eq=False)
class NamedMarkers:
    """The markers of one frame, in the order of its layout."""

    layout: MarkerLayout
    positions: NDArray[np.float64]
    """(M, 3) [m], the server's axes; a NaN row was not seen."""
    unlabelled: NDArray[np.float64]
    """(U, 3) [m]."""


class MarkerNames:
    """Names the markers of one stream; the layout object changes only when its names do."""

    def __init__(self, layout_name: str = "natnet") -> None:
        self._layout_name = layout_name
        self._described = False
        self._start(Catalogue())

    @property
    def layout(self) -> MarkerLayout:
        """All markers known so far, seen or not."""
        return self._layout

    def describe(self, definitions: ModelDef) -> None:
        """Take new model definitions; what was learnt from frames before is forgotten."""
        self._described = True
        self._start(catalogue_of(definitions))

    def agrees_with(self, frame: FrameOfData) -> bool:
        """Whether the frame's marker sets are those that were described; if not, the definitions are out of date."""
        return all(s.name == EVERYTHING or self._size_of(s.name) == len(s.positions) for s in frame.marker_sets)

    def name(self, frame: FrameOfData) -> NamedMarkers:
        """Put every marker of `frame` where its name stands in the layout."""
        self._adopt_sets(frame)
        columns = self._columns(frame)
        named = columns != _NO_COLUMN
        positions = np.full((self._catalogue.width, 3), np.nan)
        seen = _seen(frame.labelled)
        use = named & seen
        positions[columns[use]] = frame.labelled.positions[use]
        self._fill_from_sets(frame, positions)
        return NamedMarkers(self._current_layout(), positions, self._unlabelled(frame, seen & ~named))

    def _start(self, catalogue: Catalogue) -> None:
        previous = getattr(self, "_layout", None)
        self._catalogue = catalogue
        self._learnt: dict[int, tuple[Subject, int]] = {}  # asset id: subject, member id of its first marker
        self._covered: set[str] = set()  # subjects whose markers come labelled
        self._ids: NDArray[np.int32] | None = None  # of the labelled markers that `_known_columns` belongs to
        self._known_columns: NDArray[np.intp] = np.empty(0, np.intp)
        self._layout = MarkerLayout(self._layout_name, catalogue.column_names())
        if previous is not None and previous.names == self._layout.names:
            self._layout = previous

    def _current_layout(self) -> MarkerLayout:
        if len(self._layout.names) != self._catalogue.width:
            self._layout = MarkerLayout(self._layout_name, self._catalogue.column_names())
        return self._layout

    def _size_of(self, subject_name: str) -> int | None:
        subject = self._catalogue.subjects.get(subject_name)
        return None if subject is None else len(subject.marker_names)

    def _adopt_sets(self, frame: FrameOfData) -> None:
        """Number the markers of sets that no definition describes."""
        if self._described:
            return
        sets = [s for s in frame.marker_sets if s.name != EVERYTHING] or frame.marker_sets
        for s in sets:
            if s.name not in self._catalogue.subjects:
                self._catalogue.add(s.name, tuple(f"{s.name}_{i + 1}" for i in range(len(s.positions))))

    def _columns(self, frame: FrameOfData) -> NDArray[np.intp]:
        """Column of each labelled marker, (n,); -1 where it has no name."""
        ids = frame.labelled.ids
        if self._ids is not None and np.array_equal(ids, self._ids):
            return self._known_columns
        search = _Search(frame, self._catalogue, self._learnt)
        columns = np.fromiter(search.columns(), np.intp, len(ids))
        self._covered |= search.covered
        self._ids = ids.copy() if search.settled else None
        self._known_columns = columns
        return columns

    def _fill_from_sets(self, frame: FrameOfData, positions: NDArray[np.float64]) -> None:
        for s in frame.marker_sets:
            subject = self._catalogue.subjects.get(s.name)
            if subject is None or s.name in self._covered or len(s.positions) != len(subject.marker_names):
                continue
            seen = np.isfinite(s.positions).all(axis=1) & (s.positions != 0).any(axis=1)
            first = subject.first_column
            positions[first : first + len(s.positions)][seen] = s.positions[seen]

    def _unlabelled(self, frame: FrameOfData, loose: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Points without a name; older versions list them apart, where newer ones repeat what is labelled."""
        from_labelled = frame.labelled.positions[loose]
        others = frame.other_markers
        if len(others):
            told = _keys(frame.labelled.positions)
            new = [i for i, key in enumerate(_key_list(others)) if key not in told]
            others = others[new]
            others = others[np.isfinite(others).all(axis=1)]
        return np.concatenate([from_labelled, others]).astype(np.float64)


class _Search:
    """Finds the columns of one frame's labelled markers."""

    def __init__(self, frame: FrameOfData, catalogue: Catalogue, learnt: dict[int, tuple[Subject, int]]) -> None:
        self._frame = frame
        self._catalogue = catalogue
        self._learnt = learnt
        self._guessed: dict[int, tuple[Subject, int] | None] = {}
        self._by_position: dict[bytes, int] | None = None
        self.covered: set[str] = set()
        self.settled = True
        """Whether the next frame with the same ids has the same columns."""

    def columns(self) -> Iterator[int]:
        """Column of each labelled marker; -1 where it has no name. A column is given once."""
        markers = self._frame.labelled
        taken: set[int] = set()
        keys = _key_list(markers.positions)
        for row, (marker_id, params) in enumerate(zip(markers.ids.tolist(), markers.params.tolist(), strict=True)):
            column = _NO_COLUMN if params & MarkerFlag.UNLABELLED else self._column(marker_id, params, keys[row])
            if column in taken:
                column = _NO_COLUMN
            taken.add(column)
            yield column

    def _column(self, marker_id: int, params: int, key: bytes) -> int:
        if params & MarkerFlag.ACTIVE:
            return self._named_column(f"active_{marker_id}")
        if marker_id in self._catalogue.column_of_id:
            return self._catalogue.column_of_id[marker_id]
        asset_id = marker_id >> 16
        if asset_id == 0:
            self.settled = False
            return self._column_at(key)
        found = self._asset(asset_id)
        if found is None:
            return self._named_column(f"id_{asset_id}_{marker_id & _MEMBER}")
        subject, first_member = found
        column = subject.column((marker_id & _MEMBER) - first_member)
        self.covered.add(subject.name)
        return _NO_COLUMN if column is None else column

    def _asset(self, asset_id: int) -> tuple[Subject, int] | None:
        """Subject of an asset and the member id of its first marker."""
        if asset_id in self._learnt:
            return self._learnt[asset_id]
        described = self._catalogue.asset_subjects.get(asset_id)
        if described is not None:
            return described, 1
        if asset_id not in self._guessed:
            self._guessed[asset_id] = self._match(asset_id)
        return self._guessed[asset_id]

    def _match(self, asset_id: int) -> tuple[Subject, int] | None:
        """Find the marker set that repeats the asset's positions, or else the only one with room for it."""
        candidates = self._catalogue.unidentified({subject.name for subject, _ in self._learnt.values()})
        markers = self._frame.labelled
        rows = np.flatnonzero(markers.ids >> 16 == asset_id)
        members = markers.ids[rows] & _MEMBER
        sets = {s.name: s.positions for s in self._frame.marker_sets}
        best, best_count = None, 0
        for subject in candidates:
            for first_member in (1, 0):
                count = _agreement(markers, rows, members - first_member, sets.get(subject.name))
                if count > best_count:
                    best, best_count = (subject, first_member), count
        if best is not None:
            self._learnt[asset_id] = best
            return best
        self.settled = not candidates
        roomy = [s for s in candidates if members.min() >= 1 and members.max() <= len(s.marker_names)]
        return (roomy[0], 1) if len(roomy) == 1 else None

    def _column_at(self, key: bytes) -> int:
        """Column of the marker-set entry at the very same position."""
        if self._by_position is None:
            self._by_position = {}
            for s in self._frame.marker_sets:
                subject = self._catalogue.subjects.get(s.name)
                for index, entry in enumerate(_key_list(s.positions) if subject is not None else []):
                    column = subject.column(index) if subject is not None else None
                    if column is not None:
                        self._by_position.setdefault(entry, column)
        return self._by_position.get(key, _NO_COLUMN)

    def _named_column(self, name: str) -> int:
        subject = self._catalogue.subjects.get(name) or self._catalogue.add(name, (name,))
        column = subject.column(0)
        return _NO_COLUMN if column is None else column


def _seen(markers: LabelledMarkers) -> NDArray[np.bool_]:
    """(n,): measured in this frame."""
    fields = markers.table.dtype.names or ()
    seen = markers.measured & np.isfinite(markers.positions).all(axis=1)
    if "residual" in fields:
        seen &= markers.residuals >= 0
    if "params" not in fields:
        seen &= (markers.positions != 0).any(axis=1)
    return seen


def _agreement(
    markers: LabelledMarkers, rows: NDArray[np.intp], indices: NDArray[np.int32], positions: NDArray[np.float32] | None
) -> int:
    """How many of the labelled markers stand in the set where their member ids say, to the last bit."""
    if positions is None:
        return 0
    inside = (indices >= 0) & (indices < len(positions))
    own = markers.positions[rows[inside]]
    same = (own == positions[indices[inside]]).all(axis=1) & (own != 0).any(axis=1)
    return int(same.sum())


def _key_list(positions: NDArray[np.float32]) -> list[bytes]:
    """Positions as bytes, to be looked up."""
    octets = np.ascontiguousarray(positions, "<f4").tobytes()
    return [octets[i : i + 12] for i in range(0, len(octets), 12)]


def _keys(positions: NDArray[np.float32]) -> frozenset[bytes]:
    return frozenset(_key_list(positions))
