"""The joints: neck, head, jaw, eyes, and one on the skin at every site."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe.sites import rides_jaw

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.person import Person

NECK, HEAD, JAW = "neck", "head", "jaw"


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """Joints with parents before children; every rest rotation is the identity."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    """-1 for the root."""
    positions: NDArray[np.float64]
    """(J, 3) [m], ``rig``."""

    def index(self, name: str) -> int:
        """Number of the joint `name`."""
        return self.names.index(name)


def skeleton(person: Person, sites: dict[str, NDArray[np.float64]]) -> Skeleton:
    """All joints of the rig, for the place (3,) [m] of every site."""
    middle = person.eye_middle()
    proportions = person.identity.proportions
    places = {
        NECK: middle + proportions.neck_m,
        HEAD: middle + proportions.head_m,
        JAW: middle + proportions.jaw_m,
    }
    places |= person.eyes() | sites
    names = tuple(places)
    parents = {NECK: -1, HEAD: 0} | {site: names.index(JAW) for site in sites if rides_jaw(site)}
    return Skeleton(names, tuple(parents.get(name, 1) for name in names), np.array(list(places.values())))
