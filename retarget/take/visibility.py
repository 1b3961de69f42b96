"""How well each marker was seen, gathered frame by frame; a marker may appear at any time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class MarkerReport:
    """One marker over a whole take."""

    name: str
    seen: float
    """Share of the frames in which it was seen, 0 to 1."""
    gaps: int
    """Runs of frames without it."""
    longest_gap_s: float
    largest_step_mm: float
    """Longest way between two frames, one after the other, in which it was seen; NaN-free: 0 where there are none."""
    extent_mm: float
    """Diagonal of the box that it stayed in."""


class Visibility:
    """Feed it every frame in order."""

    def __init__(self) -> None:
        self.received_s: list[float] = []
        self.with_unlabelled = 0
        self.numbers: list[int] = []
        self._names: tuple[str, ...] = ()
        """Of the frame before."""
        self._columns: NDArray[np.intp] = np.empty(0, np.intp)
        """Column of each of these names."""
        self._column_of: dict[str, int] = {}
        self._rows: list[NDArray[np.bool_]] = []
        self._last = self._low = self._high = np.empty((0, 3))
        self._largest_step = np.empty(0)

    def add(self, frame: MarkerFrame) -> None:
        """Take one frame."""
        self.numbers.append(frame.number)
        self.received_s.append(frame.received_s)
        self.with_unlabelled += frame.unlabelled is not None and len(frame.unlabelled) > 0
        if frame.layout.names != self._names:
            self._adopt(frame.layout.names)
        positions = np.full((len(self._column_of), 3), np.nan)
        positions[self._columns] = frame.positions
        self._rows.append(np.isfinite(positions).all(axis=1))
        step = np.linalg.norm(positions - self._last, axis=1)
        self._largest_step = np.fmax(self._largest_step, step)
        self._low, self._high = np.fmin(self._low, positions), np.fmax(self._high, positions)
        self._last = positions

    def seen(self) -> NDArray[np.bool_]:
        """(N, M) whether each marker was seen in each frame."""
        seen = np.zeros((len(self._rows), len(self._column_of)), bool)
        for i, row in enumerate(self._rows):
            seen[i, : len(row)] = row
        return seen

    def markers(self, times_s: Array) -> tuple[MarkerReport, ...]:
        """One report a marker; `times_s` (N,) are the frames' times."""
        seen = self.seen()
        step_s = float(np.median(np.diff(times_s))) if len(times_s) > 1 else 0.0
        ends = np.append(times_s, times_s[-1:] + step_s)  # a gap lasts until the next frame
        extents = np.nan_to_num(np.linalg.norm(self._high - self._low, axis=1)) * 1e3
        steps = np.nan_to_num(self._largest_step) * 1e3
        return tuple(
            MarkerReport(
                name=name,
                seen=float(seen[:, i].mean()) if len(seen) else 0.0,
                gaps=len(starts := runs(~seen[:, i])),
                longest_gap_s=max((float(ends[end] - ends[start]) for start, end in starts), default=0.0),
                largest_step_mm=float(steps[i]),
                extent_mm=float(extents[i]),
            )
            for name, i in self._column_of.items()
        )

    def _adopt(self, names: tuple[str, ...]) -> None:
        for name in names:
            self._column_of.setdefault(name, len(self._column_of))
        new = len(self._column_of) - len(self._last)
        nothing = np.full((new, 3), np.nan)
        self._last, self._low, self._high = (np.concatenate([a, nothing]) for a in (self._last, self._low, self._high))
        self._largest_step = np.concatenate([self._largest_step, np.full(new, np.nan)])
        self._names, self._columns = names, np.array([self._column_of[name] for name in names], np.intp)


def runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """(first, one past the last) of every run of true values of (N,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
