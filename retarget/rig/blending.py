"""How the motions of several joints become the motion of one vertex: two ways with one form of call.

Linear: p' = sum_i w_i M_i p (Magnenat-Thalmann 1988), what glTF asks for. It shrinks where joints turn against each
other. Dual quaternions: the rigid motions themselves are blended, so the volume stays, at twice the cost (Kavan et
al., "Geometric skinning with approximate dual quaternion blending", ACM TOG 27(4):105, 2008).
Motions are ``T_rig_mesh``: from the bind pose to ``rig``, which is the identity where a joint stands as it was bound.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from retarget.geometry import quat_from_matrix

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray
    from scipy.sparse import csr_array

    Array = NDArray[np.float64]
    Array32 = NDArray[np.float32]
    Sparse = csr_array[np.float32, tuple[int, int]]


class Blend(Protocol):
    """Moves vertices by the weighted motions of their joints."""

    def __call__(self, T_rig_mesh: Array, positions: Array32) -> Array32:
        """(V, 3) [m], ``rig``, from the motions (J, 4, 4) of the joints and the bind positions (V, 3)."""
        ...


class LinearBlend:
    """Linear blend skinning; motions may hold scale."""

    def __init__(self, weights: Sparse) -> None:
        """For `weights` (V, J) with rows that add up to 1."""
        self._weights = weights

    def __call__(self, T_rig_mesh: Array, positions: Array32) -> Array32:
        """As `Blend`."""
        motions = T_rig_mesh[:, :3].reshape(-1, 12).astype(np.float32)
        blended = (self._weights @ motions).reshape(-1, 3, 4)
        moved: Array32 = np.einsum("vij,vj->vi", blended[:, :, :3], positions)
        moved += blended[:, :, 3]
        return moved


class DualQuaternionBlend:
    """Dual quaternion linear blending; motions must be rigid.

    q and -q are the same turn, so every motion is first brought to the hemisphere of the vertex's heaviest joint.
    """

    def __init__(self, weights: Sparse) -> None:
        """For `weights` (V, J) with rows that add up to 1, none of them empty."""
        self._weights = weights
        rows = np.repeat(np.arange(weights.shape[0]), np.diff(weights.indptr))
        heaviest = np.lexsort((-weights.data, rows))[weights.indptr[:-1]]
        pivots = weights.indices[heaviest][rows]
        self._pairs = pivots.astype(np.intp) * weights.shape[1] + weights.indices  # into a flat (J, J) table

    def __call__(self, T_rig_mesh: Array, positions: Array32) -> Array32:
        """As `Blend`."""
        turns = quat_from_matrix(T_rig_mesh[:, :3, :3])
        signs = np.where(turns @ turns.T < 0, -1.0, 1.0).astype(np.float32)
        signed = self._weights.copy()  # the object may be called from several threads
        signed.data *= signs.ravel()[self._pairs]
        blended = np.ascontiguousarray((signed @ _dual_quaternions(turns, T_rig_mesh[:, :3, 3])).T)  # (8, V)
        blended /= np.sqrt(np.einsum("qv,qv->v", blended[:4], blended[:4]))
        return _move(blended[:4], blended[4:], np.ascontiguousarray(positions.T))


BLENDS: dict[str, Callable[[Sparse], Blend]] = {"linear": LinearBlend, "dual-quaternion": DualQuaternionBlend}


def _dual_quaternions(turns: Array, translations: Array) -> Array32:
    """(J, 8) of unit quaternions (J, 4) xyzw and translations (J, 3): the turn r, and the dual part t r / 2."""
    vector, scalar = turns[:, :3], turns[:, 3:]
    dual_vector = scalar * translations + np.cross(translations, vector)
    dual_scalar = -np.sum(translations * vector, axis=1, keepdims=True)
    return np.concatenate([turns, dual_vector / 2, dual_scalar / 2], axis=1).astype(np.float32)


def _move(real: Array32, dual: Array32, points: Array32) -> Array32:
    """(V, 3): points (3, V) moved by unit dual quaternions, parts (4, V) each.

    For the real part (v, w) and the dual part (d, e), p + 2 v x (v x p + w p) is the turn and 2 (w d - e v + v x d) the
    translation; together p + 2 (v x (v x p + w p + d) + w d - e v).
    """
    v, w, d, e = real[:3], real[3], dual[:3], dual[3]
    inner = _cross(v, points)
    inner += w * points
    inner += d
    moved = _cross(v, inner)
    moved += w * d
    moved -= e * v
    moved *= 2
    moved += points
    return np.ascontiguousarray(moved.T)


def _cross(a: Array32, b: Array32) -> Array32:
    """(3, V) from (3, V) each."""
    out = np.empty_like(a)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[j], b[k], out=out[i])
        out[i] -= a[k] * b[j]
    return out
