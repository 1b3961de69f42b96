"""Weights of a rig's blend shapes from how far its sites have moved.

Minimises |(B w - d) / sigma|^2 + alpha |w - w_before|^2 + beta sum(|B_i / sigma| w_i), 0 <= w <= 1: d the displacements
of the sites [m], ``head``, B what the shapes make of them, B_i one shape's, sigma the noise of a marker. Sites that are
not seen drop out. The pull to the weights before is that of a value that wanders, so it weakens with the time between
the frames; the sum, of how far each shape moves the face, favours few shapes over many that cancel out. What the sites
seen do not show of a shape eases to rest. After J. P. Lewis, K. Anjyo, "Direct manipulation blendshapes", IEEE CG&A
30(4), 2010.

What no marker sees, or what the other shapes together imitate but for `DISTINCT_M`, is not to be told from noise; such
shapes stay at 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError
from retarget.rig.box_least_squares import BoxLeastSquares

if TYPE_CHECKING:
    from collections.abc import Collection

    from numpy.typing import NDArray

    from retarget.rig.site_shapes import SiteShapes

    Array = NDArray[np.float64]

NOISE_M = 0.0003
DISTINCT_M = 0.0015
"""Five times the noise."""
SMOOTHNESS = 200.0
"""Alpha at 60 frames a second: from one to the next a weight changes by some 0.07."""
SPARSITY = 0.7
"""Beta: a shape alone comes out too weak by what moves the markers, all taken together, by a third of the noise."""
EASE_S = 0.25
"""Time constant with which a shape that no marker shows goes to 0."""
RATE_HZ = 60.0


class ShapeSolver:
    """Solves the frames of one performance; it keeps the weights of the last one."""

    def __init__(
        self,
        shapes: SiteShapes,
        *,
        without: Collection[str] = (),
        smoothness: float = SMOOTHNESS,
        sparsity: float = SPARSITY,
    ) -> None:
        """The shapes named in `without` stay at 0 too; InputError where none is left."""
        B = shapes.displacements.reshape(-1, len(shapes.shape_names))
        allowed = [b for b, name in enumerate(shapes.shape_names) if name not in without]
        self._driven = np.array(distinct_shapes(B, allowed), np.intp)
        self.driven = tuple(shapes.shape_names[b] for b in self._driven)
        """Names of the shapes that the sites can tell."""
        self.frozen = tuple(shapes.shape_names[b] for b in allowed if b not in self._driven)
        """Names of the shapes that stay at 0 because the sites cannot tell them."""
        if not self.driven:
            raise InputError(
                f"The sites {', '.join(shapes.sites)} show none of the rig's blend shapes apart from the others: drive "
                "the joints, or use a layout with more markers."
            )
        self._B = shapes.displacements[:, :, self._driven]
        self._solve = BoxLeastSquares(self._B.reshape(B.shape[0], -1) / NOISE_M, sparsity=sparsity)
        self._smoothness, self._count = smoothness, len(shapes.shape_names)
        self.reset()

    def reset(self) -> None:
        """Forget the last frame."""
        self._solve.reset()
        self._weights = np.zeros(len(self._driven))
        self._time_s = -np.inf

    def __call__(self, displacements: Array, time_s: float) -> Array:
        """Weights (B,) for `displacements` (S, 3) [m], ``head``, a NaN row where a site is not seen.

        A frame that is no later than the one before, a doubled one, gives its weights again.
        """
        step = time_s - self._time_s
        if step > 0:
            smoothness = self._smoothness / (RATE_HZ * step)
            before = self._weights * self._faded(displacements, step)
            self._weights = self._solve(displacements.ravel() / NOISE_M, before, smoothness)
            self._time_s = time_s
        weights = np.zeros(self._count)
        weights[self._driven] = self._weights
        return weights

    def _faded(self, displacements: Array, step: float) -> Array:
        """(N,) what is left of the weights after `step` seconds, as far as the sites seen do not show them."""
        missing = np.isnan(displacements.sum(axis=1))
        if not missing.any() or not np.isfinite(step):
            return np.ones(len(self._driven))
        squares = np.einsum("scb,scb->sb", self._B, self._B)
        hidden = squares[missing].sum(axis=0) / squares.sum(axis=0)
        faded: Array = np.exp(-step / EASE_S * hidden)
        return faded


def distinct_shapes(B: Array, allowed: Collection[int]) -> list[int]:
    """Those of the `allowed` columns of B (3 S, N) [m] that the sites can tell, in their order.

    As long as there is one that the others imitate but for less than `DISTINCT_M`, with weights from 0 to 1, the one
    they imitate best goes.
    """
    left = list(allowed)
    while left:
        apart = [_apart(B, b, left) for b in left]
        least = int(np.argmin(apart))
        if apart[least] >= DISTINCT_M:
            break
        del left[least]
    return left


def _apart(B: Array, b: int, among: Collection[int]) -> float:
    """How far [m] the displacements of shape `b` are, over all sites, from the nearest that the others make."""
    if np.linalg.norm(B[:, b]) < DISTINCT_M:
        return 0.0
    others = B[:, [o for o in among if o != b]]
    return float(np.linalg.norm(B[:, b] - others @ BoxLeastSquares(others)(B[:, b])))
