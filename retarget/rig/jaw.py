"""How far the jaw is open, read from markers at the chin that turn about the performer's hinge.

``head`` frame, metres, radians. With u the lever from the hinge to a marker at rest and v the lever now, the signed
form is theta = atan2(n . (u' x v'), u' . v'), u' and v' seen along the hinge n: opening is positive, and a chin that
slides sideways does not read as opening. For several markers the sums of both arguments give the turn that fits them
all in the least squares sense. The cosine law, cos theta = (a^2 + b^2 - c^2) / (2 a b) with a = |u|, b = |v|,
c = |v - u|, is the mode of the published joint mapping: it has no sign and takes any way of the chin for opening. It is
a law for one point in the middle of the face, so several markers count as their centre.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from retarget.performer import JawMode, PerformerJaw

    Array = NDArray[np.float64]

SHORTEST_LEVER_M = 1e-3
"""Below this the direction of a lever is noise."""


def signed_angle(u: ArrayLike, v: ArrayLike, axis: ArrayLike) -> Array:
    """Turn (...) [rad] in (-pi, pi] about the unit `axis` (3,) that takes the levers u to v, (..., N, 3) [m].

    NaN rows are left out. NaN where no lever that was seen stands off the axis by `SHORTEST_LEVER_M`.
    """
    u, v, n = (np.asarray(a, float) for a in (u, v, axis))
    seen = np.isfinite(u + v).all(axis=-1, keepdims=True)
    u, v = np.where(seen, u, 0.0), np.where(seen, v, 0.0)
    sine = (np.cross(u, v) @ n).sum(axis=-1)
    cosine = ((u * v).sum(axis=-1) - (u @ n) * (v @ n)).sum(axis=-1)
    return np.where(np.hypot(sine, cosine) > SHORTEST_LEVER_M**2, np.arctan2(sine, cosine), np.nan)


def cosine_angle(u: ArrayLike, v: ArrayLike) -> Array:
    """Angle (...) [rad] in [0, pi] between the levers u and v, (..., 3) [m], by the law of cosines.

    NaN where a lever is missing or shorter than `SHORTEST_LEVER_M`. The half-angle form keeps the small angles that the
    arc cosine loses (Kahan, "Miscalculating Area and Angles of a Needle-like Triangle").
    """
    u, v = np.asarray(u, float), np.asarray(v, float)
    a, b, c = (np.linalg.norm(w, axis=-1) for w in (u, v, v - u))
    sine = np.sqrt(np.maximum((c - a + b) * (c + a - b), 0.0))
    cosine = np.sqrt(np.maximum((a + b - c) * (a + b + c), 0.0))
    return np.where(np.minimum(a, b) > SHORTEST_LEVER_M, 2 * np.arctan2(sine, cosine), np.nan)


@dataclass(frozen=True, slots=True, eq=False)
class JawReader:
    """Reads the turn of one performer's jaw, a frame at a time, without history: no reading gives NaN."""

    pivot: Array
    """(3,) [m], ``head``."""
    levers: Array
    """(N, 3) [m]: the markers at rest, from the pivot."""
    sine: Array
    cosine: Array
    """(N, 3) [m]: both sums of the signed form are linear in the levers now; these are the factors."""
    mode: JawMode

    def __call__(self, positions: Array) -> float:
        """The turn [rad] from the markers now, (N, 3) [m], ``head``; NaN where no marker that is seen has a lever."""
        levers = positions - self.pivot
        if self.mode == "cosine":
            seen = np.isfinite(levers.sum(axis=1))
            if not seen.any():
                return math.nan
            return float(cosine_angle(self.levers[seen].mean(axis=0), levers[seen].mean(axis=0)))
        if math.isnan(levers.sum()):
            levers = np.where(np.isnan(levers).any(axis=1, keepdims=True), 0.0, levers)
        sine, cosine = float(np.vdot(self.sine, levers)), float(np.vdot(self.cosine, levers))
        return math.atan2(sine, cosine) if math.hypot(sine, cosine) > SHORTEST_LEVER_M**2 else math.nan


def jaw_reader(jaw: PerformerJaw, rest: Array) -> JawReader:
    """A reader for the markers whose neutral is `rest`, (N, 3) [m], ``head``, all known."""
    u = rest - jaw.pivot
    across = u - np.outer(u @ jaw.axis, jaw.axis)
    return JawReader(jaw.pivot, u, np.cross(jaw.axis, u), across, jaw.mode)
