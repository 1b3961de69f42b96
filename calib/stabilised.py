"""The head's own motion taken out of a whole recording, and what is wrong with the head markers.

Metres, ``head``. The template is where the head markers stand in ``head``; its fit is told in `calib.rigid_fits`.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.rigid_fits import LEAST, into_head, residuals, rigid_fits, robust_rigid_fits, steady
from calib.rolling import without_spikes
from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from calib.recording import Recording

    Array = NDArray[np.float64]

SCALE_M = 0.002
"""How far a good head marker strays from the rigid head [m]: skin more than a band."""
SEEN_SHARE = 0.5
"""Part of the frames in which the head must be seen."""
NEIGHBOURS_S = 0.05
JITTER_S = 0.02
EXCHANGEABLE_M = 0.0025
"""Head markers that fit their own template this well in another order cannot be told apart [m]."""
MOST_PERMUTED = 6
"""Up to this many head markers all orders are tried, above it exchanges of two."""


@dataclass(frozen=True, slots=True, eq=False)
class Stabilised:
    """A recording in ``head``."""

    positions: Array
    """(T, M, 3) [m], without spikes; NaN where a marker or the head was not seen."""
    T_world_head: Array
    """(T, 4, 4)."""
    residual_m: float
    """RMS of the head markers about the rigid head [m], spikes left out."""
    missing: Array
    """(M,) part of the frames in which each marker was not seen."""
    spikes: Array
    """(M,) part of the frames in which each marker jumped off its path for a moment."""


def stabilised(recording: Recording, template: Array) -> Stabilised:
    """`recording` in ``head``; `template` (H, 3) [m], ``head``, of the layout's head markers, NaN where not known.

    InputError where fewer than three head markers are known, or are seen in half of the frames.
    """
    known = np.isfinite(template.sum(axis=1))
    head = np.array(recording.layout.head, np.intp)[known]
    world = recording.world[:, head]
    _require_head(recording, head, world)
    T = steady(
        robust_rigid_fits(template[known], world, SCALE_M),
        template[known].mean(axis=0),
        recording.frames_in(NEIGHBOURS_S),
        recording.frames_in(JITTER_S),
    )
    raw = into_head(T, recording.world)
    clean = without_spikes(raw)
    off = residuals(T, template[known], world)
    return Stabilised(
        positions=clean,
        T_world_head=T,
        residual_m=float(np.sqrt(np.nanmean(off[off < 3 * SCALE_M] ** 2))),
        missing=(~np.isfinite(recording.world.sum(axis=2))).mean(axis=0),
        spikes=(np.isfinite(raw) & ~np.isfinite(clean)).any(axis=2).mean(axis=0),
    )


def _require_head(recording: Recording, head: NDArray[np.intp], world: Array) -> None:
    seen = np.isfinite(world.sum(axis=2))
    share = float((seen.sum(axis=1) >= LEAST).mean()) if len(head) >= LEAST else 0.0
    if share < SEEN_SHARE:
        names = ", ".join(recording.layout.names[i] for i in recording.layout.head)
        raise InputError(
            f"Head markers are missing in {recording.name}: three or more of {names} are needed to follow the head, "
            f"and are seen in {100 * share:.0f} % of the frames."
        )


def exchangeable(template: Array, names: Sequence[str]) -> tuple[tuple[str, ...], float] | None:
    """Head markers that could exchange their names unnoticed, and how well they then fit [m]; None where none could.

    `template` (H, 3) [m], NaN rows are left out. A band should be asymmetric, so that its markers differ.
    """
    known = np.flatnonzero(np.isfinite(template.sum(axis=1)))
    points, known_names = template[known], [names[int(i)] for i in known]
    if len(points) < LEAST:
        return None
    orders = np.array(_orders(len(points)))
    shuffled = points[orders]  # (P, H, 3)
    T = rigid_fits(points, shuffled, np.ones(shuffled.shape[:2]))
    misfit = np.sqrt((residuals(T, points, shuffled) ** 2).mean(axis=1))
    best = int(np.argmin(misfit))
    if misfit[best] > EXCHANGEABLE_M:
        return None
    moved = tuple(n for n, i, j in zip(known_names, orders[best], range(len(points)), strict=True) if i != j)
    return moved, float(misfit[best])


def _orders(count: int) -> list[tuple[int, ...]]:
    """All orders but the given one, or all exchanges of two where there are many."""
    if count <= MOST_PERMUTED:
        return list(itertools.permutations(range(count)))[1:]
    orders = []
    for i, j in itertools.combinations(range(count), 2):
        order = list(range(count))
        order[i], order[j] = j, i
        orders.append(tuple(order))
    return orders
