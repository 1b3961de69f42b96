"""The head's own motion, taken out of the face: markers from ``world`` to ``head``.

Each frame the rigid motion is sought that carries the template, the head markers as they stand in ``head``, to where
they are seen; robustly, because brows pull at a forehead and a marker may be a reflection (see
`retarget.markers.rigid`).

Seen head markers  What happens
3 or more          the fit; not if they stand on one line
2                  the head coasts on its last motion, turned the least that brings the pair into line
1                  the head coasts and follows that marker
0                  the head coasts, and rests after about 0.1 s

Without three of them for longer than `TRUST_S` the face is not measured any more, whatever is seen of it: its markers
are NaN in ``head``, and the next stage holds them, until the head is back.
"""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError
from retarget.frames import MarkerFrame
from retarget.markers.head_motion import HeadMotion, turned
from retarget.markers.rigid import LEAST, Fit, fit_robust, homogeneous, pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from retarget.markers.rigid import Quat, Vector

    Array = NDArray[np.float64]

log = logging.getLogger("retarget.markers")

ORIGIN = (0.0, 0.0, 0.0)
TRUST_S = 0.1
NARROWEST_M = 0.005
"""Head markers that spread less than this about a line do not tell the turn about it."""


class Stabiliser:
    """A stage: `MarkerFrame` in ``world`` -> `MarkerFrame` in ``head``, with `T_world_head`.

    Before the head has been seen for the first time, all positions are NaN and `T_world_head` is the identity.
    """

    def __init__(self, template: Array, indices: Sequence[int], scale_m: float = 0.002) -> None:
        """`template` (H, 3) [m], ``head``: the markers `indices` (H,) of the frames at rest, NaN where not known.

        `scale_m` [m] is how far a good marker strays from the rigid template: skin some millimetres, a head band less.
        InputError where fewer than three markers of the template are known, or all stand on one line.
        """
        template = np.asarray(template, float)
        known = np.isfinite(template).all(axis=1)
        _refuse_slim(template[known])
        self._template = homogeneous(template[known])
        self._indices = np.asarray(indices, np.intp)[known]
        self._scale_m = scale_m
        self.reset()

    def reset(self) -> None:
        """Forget where the head was."""
        self._motion: HeadMotion | None = None
        self._fitted_s = -math.inf
        self._world = np.ones((len(self._indices), 4))
        self.coasting_frames = 0
        """Frames in which fewer than three head markers could be used."""
        self.swapped_frames = 0
        """Frames in which head markers had exchanged their names, and were put right."""

    def __call__(self, frame: MarkerFrame) -> MarkerFrame:
        """`frame` with its positions in ``head``."""
        self._world[:, :3] = frame.positions[self._indices]
        rows = self._seen_rows()
        fit = self._fit(rows, frame) if rows is None or len(rows) >= LEAST else None
        if fit is None:
            T, positions = self._coast(rows, frame)
        else:
            T, positions = fit
        return MarkerFrame(frame.number, frame.time_s, frame.received_s, frame.layout, positions, T, frame.unlabelled)

    def _seen_rows(self) -> NDArray[np.intp] | None:
        """Which rows of the template are seen; None for all."""
        if math.isfinite(self._world.sum()):
            return None
        return np.flatnonzero(np.isfinite(self._world).all(axis=1))

    def _fit(self, rows: NDArray[np.intp] | None, frame: MarkerFrame) -> tuple[Array, Array] | None:
        """T_world_head and the positions in ``head``; None where the seen markers stand on one line."""
        head, world = (self._template, self._world) if rows is None else (self._template[rows], self._world[rows])
        expected = self._motion.expected(frame.time_s) if self._motion else None
        T_expected = None if expected is None else pose(expected[0], ORIGIN, expected[1])
        fit, order = fit_robust(head, world, self._scale_m, T_expected)
        if fit.breadth_m < NARROWEST_M:
            return None
        self._remember(frame.time_s, fit)
        T = fit.T_world_head
        positions = (frame.positions - T[:3, 3]) @ T[:3, :3]
        if order is not None:
            indices = self._indices if rows is None else self._indices[rows]
            positions[indices] = positions[indices[list(order)]]
            self._count_swap(frame, indices, order)
        return T, positions

    def _remember(self, time_s: float, fit: Fit) -> None:
        x, y, z = fit.T_world_head[:3, 3].tolist()
        if self._motion is None:
            self._motion = HeadMotion(time_s, fit.quat, (x, y, z))
        else:
            self._motion.saw(time_s, fit.quat, (x, y, z))
        self._fitted_s = time_s

    def _count_swap(self, frame: MarkerFrame, indices: NDArray[np.intp], order: tuple[int, ...]) -> None:
        if self.swapped_frames == 0:
            names = [frame.layout.names[indices[i]] for i, j in enumerate(order) if i != j]
            log.warning("Frame %d: head markers have exchanged their names: %s", frame.number, ", ".join(names))
        self.swapped_frames += 1

    def _coast(self, rows: NDArray[np.intp] | None, frame: MarkerFrame) -> tuple[Array, Array]:
        self.coasting_frames += 1
        if self._motion is None:
            return np.eye(4), np.full_like(frame.positions, np.nan)
        motion = self._motion
        motion.coast(frame.time_s)
        rows = np.arange(len(self._template)) if rows is None else rows
        head, world = self._template[rows, :3], self._world[rows, :3]
        if len(rows) >= 2:
            motion.quat = _aligned(motion.quat, *_widest_pair(head, world))
        T = pose(motion.quat, ORIGIN, motion.position)
        if len(rows) > 0:
            T[:3, 3] = world.mean(axis=0) - T[:3, :3] @ head.mean(axis=0)
            x, y, z = T[:3, 3].tolist()
            motion.position = (x, y, z)
        if frame.time_s - self._fitted_s > TRUST_S:
            return T, np.full_like(frame.positions, np.nan)
        return T, (frame.positions - T[:3, 3]) @ T[:3, :3]


def _refuse_slim(template: Array) -> None:
    if len(template) < LEAST:
        raise InputError(
            f"Only {len(template)} of the head's markers were seen at rest; {LEAST} are needed to follow the head."
        )
    spread = np.linalg.svd(template - template.mean(axis=0), compute_uv=False) / math.sqrt(len(template))
    if spread[1] < NARROWEST_M:
        raise InputError(
            "The head's markers stand on one line; place one of them aside, so that the head's turn is seen."
        )


def _widest_pair(head: Array, world: Array) -> tuple[Vector, Vector]:
    """The direction between the two markers farthest apart: ``head`` and ``world``."""
    apart = np.linalg.norm(head[:, None] - head[None], axis=-1)
    i, j = np.unravel_index(int(apart.argmax()), apart.shape)
    a, b = (head[j] - head[i]).tolist(), (world[j] - world[i]).tolist()
    return (a[0], a[1], a[2]), (b[0], b[1], b[2])


def _aligned(quat: Quat, head: Vector, world: Vector) -> Quat:
    """`quat`, turned the least that lays the direction `head` along `world`."""
    x, y, z, w = quat
    a = turned(turned(quat, (*head, 0.0)), (-x, -y, -z, w))[:3]
    b = world
    cross = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    lengths = math.sqrt(sum(v * v for v in a) * sum(v * v for v in b))
    half = (*cross, lengths + sum(p * q for p, q in zip(a, b, strict=True)))
    norm = math.sqrt(sum(v * v for v in half))
    if norm < 1e-6 * max(lengths, 1e-12):  # opposite directions: no least turn
        return quat
    return turned((half[0] / norm, half[1] / norm, half[2] / norm, half[3] / norm), quat)
