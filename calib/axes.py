"""Which way the performer's head looks, told by how the face moves.

Faces differ, so a neutral laid onto the rig's sites leaves the head's axes some degrees off, and a brow that goes
straight up seems to go up and back. Across all sites and poses, K is sought together with the small turn r of the
axes: y = K (x + r x x), in turns, with the shape's own answer as a prior.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calib.gains import predicted, solve_gains
from retarget import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from calib.pairs import Pairs

    Array = NDArray[np.float64]

ROUNDS = 12
PRIOR_RAD = np.radians(3.0)
"""How far off the shape alone leaves the axes."""
LEAST_STYLE_MM = 0.1
"""A performer's way of making a pose differs from the rig's, beside K, by as much as the misfits say, and by this."""
FARTHEST_RAD = np.radians(8.0)


def refine_axes(pairs: Pairs, graph: Array, default: float) -> Array:
    """R (3, 3): takes vectors in the head's axes so far to those in which K explains the poses best."""
    R = np.eye(3)
    if not pairs.names:
        return R
    for _ in range(ROUNDS):
        turned = pairs.turned(R)
        K = solve_gains(turned, graph, default).K
        R = _limited(_turn(turned, K, R) @ R)
    return R


def _turn(pairs: Pairs, K: Array, R_so_far: Array) -> Array:
    """One step of Gauss and Newton, robust, towards the prior."""
    x, y = 1e3 * pairs.seen, 1e3 * pairs.rig
    slope = np.where(x >= 0, K[0], K[1])
    misfit = y - predicted(K, x)
    J = slope[..., None] * -_cross_matrices(x)  # d(r x x)/dr = -[x]
    off = np.linalg.norm(misfit, axis=-1)
    counted = off[pairs.weights > 0]
    style = max(LEAST_STYLE_MM, float(np.median(counted)) if counted.size else 0.0)
    weights = (pairs.weights * np.minimum(1.0, style / np.maximum(off, 1e-9)))[..., None] / style**2
    information = np.einsum("psxi,psxj->ij", J * weights[..., None], J) + np.eye(3) / PRIOR_RAD**2
    right = np.einsum("psxi,psx->i", J * weights[..., None], misfit) - _vector(R_so_far) / PRIOR_RAD**2
    return _rotation(np.linalg.solve(information, right))


def _cross_matrices(x: Array) -> Array:
    """(..., 3, 3): [x] with [x] v = x x v."""
    zero = np.zeros(x.shape[:-1])
    a, b, c = np.moveaxis(x, -1, 0)
    rows = [[zero, -c, b], [c, zero, -a], [-b, a, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _vector(R: Array) -> Array:
    """The rotation vector of a turn below a half."""
    q = geometry.quat_from_matrix(R)
    length = float(np.linalg.norm(q[:3]))
    angle = 2 * np.arctan2(length, q[3])
    vector: Array = q[:3] / max(length, 1e-12) * angle
    return vector


def _rotation(vector: Array) -> Array:
    angle = float(np.linalg.norm(vector))
    return geometry.matrix_from_quat(geometry.quat_from_axis_angle(vector / max(angle, 1e-12), angle))


def _limited(R: Array) -> Array:
    vector = _vector(R)
    angle = float(np.linalg.norm(vector))
    return R if angle <= FARTHEST_RAD else _rotation(vector * FARTHEST_RAD / angle)
