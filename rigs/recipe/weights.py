"""Smooth skin weights over a surface: bounded biharmonic weights.

For every handle h the field w_h minimises the bending energy |Laplace w_h|^2 with 0 <= w_h <= bound and given values
at the handles, so that the skin follows a handle fully where it stands and blends without a crease to its neighbours.
Distances are those along the surface: the upper lip is far from the lower one. Jacobson, Baran, Popovic, Sorkine:
Bounded Biharmonic Weights for Real-Time Deformation, SIGGRAPH 2011, eq. 1 to 4; solved by the alternating direction
method of multipliers (Boyd et al. 2011, section 5.2).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph
from scipy.sparse.linalg import splu

if TYPE_CHECKING:
    from numpy.typing import NDArray

ITERATIONS = 400
PENALTY = 4.0
"""Of the split variable [1/cm^4]: couples over about a centimetre."""
CENTIMETRES_PER_METRE = 100.0


def cotangent_laplacian(
    positions: NDArray[np.float64], triangles: NDArray[np.intp]
) -> tuple[sparse.csr_array, NDArray[np.float64]]:
    """Stiffness matrix (V, V) and the area (V,) of each vertex; every angle is kept from degenerating."""
    count = len(positions)
    rows, columns, values = [], [], []
    area = np.zeros(count)
    for k in range(3):
        i, j, o = triangles[:, (k + 1) % 3], triangles[:, (k + 2) % 3], triangles[:, k]
        a, b = positions[i] - positions[o], positions[j] - positions[o]
        doubled = np.maximum(np.linalg.norm(np.cross(a, b), axis=1), 1e-9)
        half_cotangent = np.clip(0.5 * (a * b).sum(1) / doubled, -2.0, 10.0)
        np.add.at(area, o, doubled / 6)
        rows += [i, j, i, j]
        columns += [j, i, i, j]
        values += [-half_cotangent, -half_cotangent, half_cotangent, half_cotangent]
    stiffness = sparse.csr_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(count, count)
    )
    return stiffness, area


def bounded_biharmonic(
    positions: NDArray[np.float64],
    triangles: NDArray[np.intp],
    given: NDArray[np.float64],
    bound: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Weights (V, H), rows add up to 1.

    `positions` (V, 3) [m]; `given` (V, H) holds the weights of the vertices that are handles and NaN rows elsewhere;
    `bound` (V, H) is the largest weight allowed, 0 where a handle must not reach.
    """
    stiffness, area = cotangent_laplacian(positions * CENTIMETRES_PER_METRE, triangles)
    energy = (stiffness @ sparse.diags_array(1 / area) @ stiffness).tocsr()
    free = np.flatnonzero(np.isnan(given[:, 0]))
    fixed = np.flatnonzero(~np.isnan(given[:, 0]))
    mass = PENALTY * area[free, None]
    solve = splu((energy[free][:, free] + sparse.diags_array(mass[:, 0])).tocsc()).solve
    pull = energy[free][:, fixed] @ given[fixed]
    split = np.zeros((len(free), given.shape[1]))
    dual = np.zeros_like(split)
    for _ in range(ITERATIONS):
        smooth = solve(mass * (split - dual) - pull)
        split = np.clip(smooth + dual, 0.0, bound[free])
        dual += smooth - split
    weights = given.copy()
    weights[free] = split
    normalised: NDArray[np.float64] = weights / weights.sum(axis=1, keepdims=True)
    return normalised


def surface_distance(
    positions: NDArray[np.float64], triangles: NDArray[np.intp], sources: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Shortest way (V,) [m] along edges from each vertex to the nearest of `sources`; infinite on another piece."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    lengths = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1)
    edges, index = np.unique(np.sort(edges, axis=1), axis=0, return_index=True)
    graph = sparse.csr_array((lengths[index], (edges[:, 0], edges[:, 1])), shape=(len(positions),) * 2)
    distance: NDArray[np.float64] = csgraph.dijkstra(graph, directed=False, indices=sources, min_only=True)
    return distance


def strongest(weights: NDArray[np.float64], count: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """The `count` largest weights of each row as (joints, weights), each (V, count), rows add up to 1.

    The first weight that is left out is subtracted from those kept, so that the result stays continuous where two
    weights change places.
    """
    order = np.argsort(-weights, axis=1, kind="stable")[:, : count + 1]
    values = np.take_along_axis(weights, order, axis=1)
    kept = np.maximum(values[:, :count] - values[:, count:], 0.0)
    return order[:, :count], kept / kept.sum(axis=1, keepdims=True)
