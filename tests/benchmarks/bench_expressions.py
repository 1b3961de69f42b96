"""Which expression is read off noisy markers: the confusion matrix on the performer whose weights are known.

He plays each expression at a third of its strength to all of it, unevenly, with a tinge of another and sometimes
speaking; frames count where it is held. 0.3 mm of noise on every coordinate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget.rig.expressions import ExpressionRule
from retarget.rig.load import load_rig
from retarget.rig.shapes import NOISE_M, ShapeSolver
from retarget.rig.site_shapes import site_shapes
from tests.benchmarks.report import Row
from tests.synthetic.face import ALL_SITES, FACE24_SITES
from tests.synthetic.weights import PROTOTYPES, moves, performance

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Counts = NDArray[np.intp]

EXPRESSIONS = tuple(PROTOTYPES)
SEEDS = range(100, 106)


def rows() -> Iterator[Row]:
    """A row of the matrix for each expression that is meant, and the share that is right."""
    for layout, sites in (("24 markers", FACE24_SITES), ("41 markers", ALL_SITES)):
        matrix = confusion(sites)
        share = matrix / matrix.sum(axis=1, keepdims=True)
        for i, meant in enumerate(EXPRESSIONS):
            called = ", ".join(f"{name} {100 * s:.0f}" for name, s in zip(EXPRESSIONS, share[i], strict=True))
            yield Row(f"{layout}, {meant} called [%]: {called}; right", 100 * share[i, i], "%")
        yield Row(f"{layout}, all right", 100 * share.diagonal().mean(), "%", aim="90")


def confusion(sites: tuple[str, ...]) -> Counts:
    """(5, 5) frames: rows what is meant, columns what it is called."""
    rig = load_rig("human")
    shapes = site_shapes(rig, sites)
    solver = ShapeSolver(shapes)
    rule = ExpressionRule(rig.shape_names, solver.driven)
    counts = np.zeros((5, 5), np.intp)
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        played = performance(rig.shape_names, rng)
        solver.reset()
        for t, moved in enumerate(moves(shapes, played.weights, rng, NOISE_M)):
            found = rule(solver(moved, float(played.times[t]))).expression
            if played.held[t]:
                counts[EXPRESSIONS.index(played.labels[t]), EXPRESSIONS.index(found)] += 1
    return counts
