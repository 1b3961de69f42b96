"""What a reduction did: keys before and after, and the largest error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from retarget.export.keys.distance import euclidean

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from retarget.export.keys.curve import Curve
    from retarget.export.keys.distance import Distance

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class KeyReport:
    """Of one kind of channel."""

    what: str
    """As in "translations"."""
    before: int
    """Keys recorded."""
    after: int
    """Keys kept."""
    largest_error: float
    """Of the curve, evaluated as a player does at every recorded time, in `unit`."""
    unit: str

    def __str__(self) -> str:
        share = f"{100 * self.after / self.before:.1f} %" if self.before else "none"
        return (
            f"{self.what}: {self.before} keys before, {self.after} after ({share}), "
            f"largest error {self.largest_error:.4g} {self.unit}"
        )


def report_keys(
    what: str, unit: str, recorded: list[tuple[Array, Array]], curves: list[Curve], distance: Distance = euclidean
) -> KeyReport:
    """Measure `curves` against the `recorded` times (N,) and values (N, C) of each."""
    errors = [distance(curve(t), v).max(initial=0.0) for (t, v), curve in zip(recorded, curves, strict=True)]
    return KeyReport(
        what,
        before=sum(len(t) for t, _ in recorded),
        after=sum(len(curve.times_s) for curve in curves),
        largest_error=float(max(errors, default=0.0)),
        unit=unit,
    )
