"""Pairs of displacements that mean the same: how far a site of the performer went, and how far the rig's should go.

One pair a pose: an expression found in a range of motion, or a named pose of the rig that the performer mimicked.
Metres; the performer's side in the performer's ``head``, the rig's in the rig's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from calib.expressions import BY_NAME, side_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from calib.matching import Match
    from calib.rig_range import RigExtreme

    Array = NDArray[np.float64]


REGION_M = 0.0005
"""A pose says nothing of a site that the rig moves by less than this [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """P poses at S sites."""

    names: tuple[str, ...]
    """(P,)"""
    seen: Array
    """(P, S, 3) [m], the performer; 0 where not known, where the weight is 0 too."""
    rig: Array
    """(P, S, 3) [m], the rig."""
    weights: Array
    """(P, S) in [0, 1]: how far each is trusted."""

    def turned(self, R: Array) -> Pairs:
        """With the performer's side in axes turned by R (3, 3)."""
        return replace(self, seen=self.seen @ R.T)

    def without(self, pose: int) -> Pairs:
        """All poses but one."""
        return self.only(np.arange(len(self.names)) != pose)

    def only(self, chosen: NDArray[np.bool_]) -> Pairs:
        """The poses of a mask (P,)."""
        names = tuple(name for name, keep in zip(self.names, chosen, strict=True) if keep)
        return Pairs(names, self.seen[chosen], self.rig[chosen], self.weights[chosen])

    def joined(self, other: Pairs) -> Pairs:
        """The poses of both."""
        return Pairs(
            self.names + other.names,
            np.concatenate([self.seen, other.seen]),
            np.concatenate([self.rig, other.rig]),
            np.concatenate([self.weights, other.weights]),
        )


def make_pairs(poses: Sequence[tuple[str, Array, Array, Array]], sites: int) -> Pairs:
    """From (name, performer's moves (S, 3) with NaN, rig's moves (S, 3), weights (S,)) each."""
    seen = np.array([p[1] for p in poses]).reshape(-1, sites, 3)
    weights = np.array([p[3] for p in poses]).reshape(-1, sites)
    known = np.isfinite(seen).all(axis=2)
    return Pairs(
        tuple(p[0] for p in poses),
        np.where(known[..., None], seen, 0.0),
        np.array([p[2] for p in poses]).reshape(-1, sites, 3),
        np.where(known, weights, 0.0),
    )


def pairs_of_matches(
    matches: Sequence[Match],
    extremes: Sequence[RigExtreme],
    sites: Sequence[str],
    moves: Sequence[Array] | None = None,
) -> Pairs:
    """A pair for each expression that was made: each side's sites from its own match, the middle from the whole.

    `moves` (S, 3) [m] for each match may stand for the matches' own; NaN where not known.
    """
    rig = {extreme.name: extreme for extreme in extremes}
    sides = np.array([side_of(site) for site in sites])
    poses = []
    for name, extreme in rig.items():
        seen = np.full(extreme.moves.shape, np.nan)
        weights = np.zeros(len(sites))
        for match, seen_moves in zip(matches, moves or [m.moves for m in matches], strict=True):
            if match.name == name and match.exercised:
                rows = (sides == match.side) if BY_NAME[name].sides else np.ones(len(sites), bool)
                seen[rows] = seen_moves[rows]
                weights[rows] = match.likeness**2 * concerned(extreme)[rows]
        if np.isfinite(seen).any():
            poses.append((name, seen, extreme.moves, weights))
    return make_pairs(poses, len(sites))


def concerned(extreme: RigExtreme) -> Array:
    """(S,) 1 for the sites that the rig moves; its region. The others say nothing of K, whatever they do."""
    moved: Array = (np.linalg.norm(extreme.moves, axis=1) > REGION_M).astype(float)
    return moved
