"""From a source's own marker names to those of a layout: the first stage.

Points of other names are handed on as unlabelled points, and reported once, never silently dropped.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np

from retarget.frames import MarkerFrame
from retarget.markers.layouts import no_marker_known

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerLayout
    from retarget.markers.layouts import Layout

    Array = NDArray[np.float64]

log = logging.getLogger("retarget.markers")


class Labeller:
    """A stage: `MarkerFrame` in any layout -> `MarkerFrame` in one layout; what the source does not have is NaN.

    InputError where the source has no marker that the layout knows. Should it lose them all later, as when somebody
    switches assets during a session, every marker is NaN until they are back.
    """

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.unmatched: tuple[str, ...] = ()
        """Names of the source that the layout does not know."""
        self.missing: tuple[str, ...] = ()
        """Markers of the layout that the source does not have."""
        self.reset()

    def reset(self) -> None:
        """Forget the source's layout."""
        self._source: MarkerLayout | None = None
        self._has_matched = False

    def __call__(self, frame: MarkerFrame) -> MarkerFrame:
        """`frame` in the layout, positions still in the same frame of reference."""
        if frame.layout is self.layout.markers:
            return frame
        if frame.layout is not self._source:
            self._learn(frame.layout)
        positions = np.full((len(self.layout.markers.names), 3), np.nan)
        positions[self._present] = frame.positions[self._at]
        unlabelled = self._rest_of(frame) if self._others.size else frame.unlabelled
        return MarkerFrame(
            frame.number, frame.time_s, frame.received_s, self.layout.markers, positions, frame.T_world_head, unlabelled
        )

    def _learn(self, source: MarkerLayout) -> None:
        match = self.layout.match(source.names)
        unmatched = tuple(source.names[i] for i in match.unmatched)
        missing = tuple(name for name, at in zip(self.layout.markers.names, match.at, strict=True) if at < 0)
        matched = len(missing) < len(match.at)
        if not matched and not self._has_matched:
            raise no_marker_known(source.names, [self.layout])
        if self._source is None or (unmatched, missing) != (self.unmatched, self.missing):
            _report(self.layout.name, unmatched, missing)
        self._source, self._has_matched = source, True
        self.unmatched, self.missing = unmatched, missing
        index = np.array(match.at, np.intp)
        self._present = np.flatnonzero(index >= 0)
        self._at = index[self._present]
        self._others = np.array(match.unmatched, np.intp)

    def _rest_of(self, frame: MarkerFrame) -> Array | None:
        """(U, 3): the points of names that the layout does not know, with those that carry none."""
        others = frame.positions[self._others]
        others = others[~np.isnan(others).any(axis=1)]
        return others if frame.unlabelled is None else np.concatenate([others, frame.unlabelled])


def _report(layout: str, unmatched: tuple[str, ...], missing: tuple[str, ...]) -> None:
    if unmatched:
        log.warning("Markers unknown to the layout %s, kept as unlabelled points: %s", layout, ", ".join(unmatched))
    if missing:
        log.warning("Markers of the layout %s that the source does not have: %s", layout, ", ".join(missing))
