"""K for every site, axis and direction, out of pairs of displacements of the performer and the rig.

For each axis and direction K minimises, over the poses e and the sites s,

    sum w (y_es - K_s x_es)^2 + strength sum_edges (K_i - K_j)^2 + anchor sum_s (K_s - K_0)^2,

x the performer's displacement, y the rig's, both in millimetres, w the trust in the pose times Huber's weight. A
pair counts along an axis where the rig moves, and where both move the same way: what goes another way is a difference
of style, and no gain undoes it. The edges join what acts alike: neighbours of one region, the same place on the other
side, up and down of one site. So a value that the data tell is theirs, one that they hardly tell is its region's, and
one of a region that never moved stays at K_0, the ratio of sizes.
Ridge regression with a graph Laplacian; Huber 1964.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.expressions import mirror_of, region_of, side_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from calib.pairs import Pairs

    Array = NDArray[np.float64]

STRENGTH = 0.1
"""[mm^2]: displacements good to a tenth of a millimetre or so, neighbours' K alike to about a third."""
ANCHOR = 0.001
"""[mm^2]: only what nothing else tells."""
REWEIGHTINGS = 6
HUBER = 1.345
LEAST_SPREAD_MM = 0.3
LEAST_MM = 0.4
"""The rig hardly moves along an axis where it moves by less [mm]."""
NEIGHBOURS = 3
SAME_SITE = 0.5
"""Weight of the edge between both directions of one axis at one site."""


@dataclass(frozen=True, slots=True, eq=False)
class Gains:
    """K of S sites."""

    K: Array
    """(2, S, 3): for displacements towards the positive side of each axis, and towards the negative."""
    confidence: Array
    """(2, S, 3) in [0, 1]: the part of each value that its own data told; the rest is its neighbours'."""


def solve_gains(pairs: Pairs, graph: Array, default: float, strength: float = STRENGTH) -> Gains:
    """Gains out of `pairs`; `graph` is that of `site_graph`, `default` is K_0."""
    x, y = 1e3 * pairs.seen, 1e3 * pairs.rig
    directions = np.stack([(x > 0) & (y > LEAST_MM), (x < 0) & (y < -LEAST_MM)])  # (2, P, S, 3)
    trust = pairs.weights[..., None] * np.ones(3)
    huber = np.ones_like(x)
    K = np.full((2, *x.shape[1:]), default)
    for _ in range(REWEIGHTINGS):
        K, confidence = _solve(directions * (trust * huber), x, y, graph, default, strength)
        residual = np.abs(y - predicted(K, x))
        counted = residual[(trust > 0) & directions.any(axis=0)]
        spread = max(LEAST_SPREAD_MM, 1.4826 * float(np.median(counted))) if counted.size else LEAST_SPREAD_MM
        huber = np.minimum(1.0, HUBER * spread / np.maximum(residual, 1e-9))
    return Gains(K, confidence)


def predicted(K: Array, moves: Array) -> Array:
    """The rig's displacements (..., S, 3) of the performer's, by K (2, S, 3)."""
    there: Array = K[0] * np.maximum(moves, 0.0) + K[1] * np.minimum(moves, 0.0)
    return there


def _solve(weights: Array, x: Array, y: Array, graph: Array, default: float, strength: float) -> tuple[Array, Array]:
    """K and confidence (2, S, 3) of weights (2, P, S, 3)."""
    own = (weights * x**2).sum(axis=1)  # (2, S, 3)
    cross = (weights * x * y).sum(axis=1)
    told = own.reshape(-1, 3).T  # (3, 2 S)
    system = strength * graph + ANCHOR * np.eye(told.shape[1])
    system = system + told[:, :, None] * np.eye(told.shape[1])
    right = cross.reshape(-1, 3).T + ANCHOR * default
    K = np.linalg.solve(system, right[..., None])[..., 0]
    confidence = told * np.diagonal(np.linalg.inv(system), axis1=1, axis2=2)
    return K.T.reshape(own.shape), confidence.T.reshape(own.shape)


def site_graph(sites: Sequence[str], rest: Array) -> Array:
    """(3, 2 S, 2 S): for each axis, the Laplacian over both directions of all sites, which stand at `rest` (S, 3)."""
    count = len(sites)
    graph = np.zeros((3, 2 * count, 2 * count))
    for a in range(3):
        for i, j, weight in _edges(sites, rest, a):
            graph[a, [i, j], [i, j]] += weight
            graph[a, [i, j], [j, i]] -= weight
    return graph


def _edges(sites: Sequence[str], rest: Array, axis: int) -> list[tuple[int, int, float]]:
    """Of one axis, between nodes i and j: the site's index, plus S for the negative direction.

    Along x, what is positive on the left is negative on the right.
    """
    count = len(sites)
    edges = [(i, i + count, SAME_SITE) for i in range(count)]
    for i, site in enumerate(sites):
        for j in _neighbours(i, sites, rest):
            edges += [(i, j, 0.5), (i + count, j + count, 0.5)]
        if side_of(site) == "Left" and mirror_of(site) in sites:
            j = sites.index(mirror_of(site))
            other = count if axis == 0 else 0
            edges += [(i, j + other, 1.0), (i + count, j + count - other, 1.0)]
    return edges


def _neighbours(i: int, sites: Sequence[str], rest: Array) -> list[int]:
    """The nearest sites of the same region that are not on the other side."""
    same = [
        j
        for j, site in enumerate(sites)
        if j != i and region_of(site) == region_of(sites[i]) and {side_of(site), side_of(sites[i])} != {"Left", "Right"}
    ]
    distances = np.linalg.norm(rest[same] - rest[i], axis=1) if same else np.zeros(0)
    return [same[k] for k in np.argsort(distances)[:NEIGHBOURS]]
