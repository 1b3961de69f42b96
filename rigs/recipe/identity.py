"""Who the head belongs to: the mix of MakeHuman's targets, a warp on top of it, and sizes of what is set into the skin.

An identity is data alone; `human` is the default rig's person, others are beside their `rigs/build_*.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe.palette import Palette

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rigs.recipe.hair import Hairdo
    from rigs.recipe.warp import Bulge

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Proportions:
    """Where the large joints are, seen from the middle between the eyes [m], and the sizes of teeth and iris."""

    jaw_m: Triple = (0.0, -0.0267, -0.0555)
    """The ear-to-ear hinge in front of the ear canals."""
    head_m: Triple = (0.0, -0.037, -0.078)
    neck_m: Triple = (0.0, -0.108, -0.095)
    teeth: float = 1.0
    """Size against an adult's."""
    iris_deg: float = 25.5
    """Radius of the iris, seen from the middle of the eyeball."""


@dataclass(frozen=True, slots=True)
class Lashes:
    """MakeHuman's strip (lower, upper lid), the number of hairs, their length in widths of the strip."""

    strips: tuple[tuple[str, int, float], ...] = (("1", 20, 0.26), ("2", 40, 0.6))
    upper: tuple[int, int, int] = (34, 25, 21)
    lower: tuple[int, int, int] = (112, 78, 64)

    def picture(self) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
        """(4, 4, 3): the colour of the upper lashes over that of the lower ones."""
        return np.array([[self.upper] * 4] * 2 + [[self.lower] * 4] * 2, dtype=np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class Identity:
    """One head."""

    name: str
    origins: Mapping[str, float]
    """Shares of MakeHuman's origins."""
    ages: Mapping[str, float]
    """Shares of MakeHuman's ages."""
    male: float
    details: Mapping[str, float]
    """Weights of single features, by target name."""
    warp: tuple[Bulge, ...] = ()
    """Applied one after the other to the mixed targets."""
    proportions: Proportions = field(default_factory=Proportions)
    palette: Palette = field(default_factory=Palette)
    lashes: Lashes = field(default_factory=Lashes)
    hairdo: Hairdo | None = None
    """A shell of hair over the scalp; cropped, painted hair alone where there is none."""

    def macro(self) -> dict[str, float]:
        """Weights of the macro targets, as MakeHuman has them: origin x sex x age, and sex x age x muscle x weight."""
        sexes = {"male": self.male, "female": 1 - self.male}
        targets = {
            f"macrodetails/{origin}-{sex}-{age}": share * part * years
            for origin, share in self.origins.items()
            for sex, part in sexes.items()
            for age, years in self.ages.items()
        }
        build = {
            f"macrodetails/universal-{sex}-{age}-averagemuscle-averageweight": part * years
            for sex, part in sexes.items()
            for age, years in self.ages.items()
        }
        return targets | build


HUMAN = Identity(
    name="human",
    origins={"african": 0.2, "asian": 0.25, "caucasian": 0.55},
    ages={"young": 1.0},
    male=0.3,
    details={
        "eyes/l-eye-scale-incr": 0.45,
        "eyes/r-eye-scale-incr": 0.45,
        "eyes/l-eye-height2-incr": 0.25,
        "eyes/r-eye-height2-incr": 0.25,
        "mouth/mouth-scale-vert-decr": 0.15,
        "head/head-oval": 0.25,
    },
)
"""A pleasant, neutral adult of no particular origin."""
