"""Smooth changes of proportion: a part of the head made larger or smaller about a point, easing to nothing around it.

A warp acts on every point in space, so mesh, helpers and shapes stay together: lids still meet, eyes still turn in
their sockets. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe.paint import smoothstep

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Bulge:
    """Scales what is within `inner_m` of a point by `scale`, leaves what is beyond `outer_m`, and eases between.

    The point is `about`, the middle of a group of MakeHuman's vertices, moved by `shift_m`.
    """

    about: str
    shift_m: tuple[float, float, float]
    scale: tuple[float, float, float]
    inner_m: float
    outer_m: float

    def __call__(self, points: Points, centre: Points) -> Points:
        """Where the points (N, 3) go; `centre` (3,) is the middle of the group before any warp."""
        away = points - centre - np.array(self.shift_m)
        share = smoothstep(self.outer_m, self.inner_m, np.linalg.norm(away, axis=1))
        return np.asarray(points + share[:, None] * (np.array(self.scale) - 1) * away)


def apply_warp(bulges: Iterable[tuple[Bulge, Points]], points: Points) -> Points:
    """The points (N, 3) after every bulge about its centre, in order."""
    for bulge, centre in bulges:
        points = bulge(points, centre)
    return points
