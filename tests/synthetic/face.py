"""The performer: a face of another identity and size than the rig's, with gains, a hinge and a jaw of its own.

Everything is known: `SyntheticFace.performer` is the truth that a calibration should find again. Metres, the
performer's ``head``, as in `retarget.performer`.
"""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget import geometry
from retarget.frames import MarkerLayout
from retarget.performer import Performer, PerformerJaw, gain_matrix
from tests.synthetic.rig import site_rests

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.rig.model import Rig

    Array = NDArray[np.float64]

SIDED = ("browInner", "browMid", "browOuter", "noseWing", "cheekUpper", "lipUpper", "lipCorner", "lipLower")
FACE24_SITES = (
    *(f"{n}{side}" for n in SIDED for side in ("Left", "Right")),
    "noseBridge",
    "lipUpper",
    "lipLower",
    "chin",
)
ALL_SITES = tuple(site_rests())
HEAD_BAND = {
    "headFrontLeft": (0.060, 0.170, 0.080),
    "headFrontRight": (-0.068, 0.172, 0.074),
    "headBackLeft": (0.072, 0.183, -0.085),
    "headBackRight": (-0.070, 0.168, -0.092),
}
"""[m], ``head`` of the small rig: on the hair line, asymmetric, as a band should be."""
STAND_OFF_M = 0.002
"""A marker's centre stands this far off the skin."""


@dataclass(frozen=True, slots=True, eq=False)
class SyntheticFace:
    """One person, and the rig that is meant to move like this person."""

    rig: Rig
    layout: MarkerLayout
    performer: Performer


def face_layout(name: str = "face24", sites: tuple[str, ...] = FACE24_SITES) -> MarkerLayout:
    """A marker at each of `sites`, named like it, after the four of the head band."""
    names = (*HEAD_BAND, *sites)
    return MarkerLayout(name, names, ("",) * len(HEAD_BAND) + sites, tuple(range(len(HEAD_BAND))))


def make_face(rig: Rig, layout: MarkerLayout, rng: np.random.Generator) -> SyntheticFace:
    """A face out of the rig's: smaller or larger by up to a fifth, differently shaped by some millimetres.

    K is diagonal, each axis of each site between half and the whole of the size ratio. The hinge is a few millimetres
    and degrees off where the rig's size would put it, so that nobody finds it without looking.
    """
    scale = rng.uniform(0.85, 1.2)
    rests = np.array([_rest(rig, name, site) for name, site in zip(layout.names, layout.sites, strict=True)])
    identity = _Identity(scale, rng)
    if rig.jaw is None:
        raise ValueError("A synthetic face needs a rig with a jaw.")
    jaw = PerformerJaw(
        axis=_unit(rig.jaw.axis + rng.normal(scale=0.03, size=3)),
        pivot=identity.warped(rig.jaw.pivot[None])[0] + rng.normal(scale=0.003, size=3),
        gain=rng.uniform(0.75, 1.1),
        min_rad=rig.jaw.min_rad,
        max_rad=rig.jaw.max_rad,
    )
    performer = Performer(
        name="synthetic",
        rig=rig.name,
        layout=layout.name,
        date=datetime.date(2026, 1, 1),
        markers=layout.names,
        head_markers=tuple(layout.names[i] for i in layout.head),
        neutral=identity.warped(rests) + STAND_OFF_M * _outwards(rests),
        noise=np.zeros(len(rests)),
        scale=scale,
        K={site: gain_matrix(scale * rng.uniform(0.5, 1.0, 3)) for site in layout.sites if site in rig.sites},
        jaw=jaw,
    )
    return SyntheticFace(rig, layout, performer)


class _Identity:
    """A smooth change of shape: each axis stretched by some per cent, with waves of some millimetres on top."""

    def __init__(self, scale: float, rng: np.random.Generator) -> None:
        self._stretch = (1 + rng.uniform(-0.05, 0.05, 3)) / scale
        self._waves = rng.normal(scale=30.0, size=(6, 3))  # [1/m]: a wave length of about 10 cm and more
        self._phases = rng.uniform(0, 2 * np.pi, 6)
        self._amplitudes = rng.normal(scale=0.0008, size=(6, 3))

    def warped(self, p_rig_head: Array) -> Array:
        """The performer's points [m] for those of the rig, both (N, 3), ``head``."""
        waves: Array = np.sin(p_rig_head @ self._waves.T + self._phases) @ self._amplitudes
        return p_rig_head * self._stretch + waves


def head_size(rig: Rig) -> tuple[Array, float]:
    """T_head_small and scale: places on the small rig's ``head`` to those of `rig`, by their common sites."""
    small = site_rests()
    common = [name for name in small if name in rig.sites]
    return geometry.umeyama(np.array([small[n] for n in common]), np.array([rig.sites[n].rest for n in common]))


def _rest(rig: Rig, name: str, site: str) -> Array:
    if site:
        return rig.sites[site].rest
    T_head_small, size = head_size(rig)
    place: Array = geometry.apply(T_head_small, size * np.array([HEAD_BAND[name]]))[0]
    return place


def _outwards(points: Array) -> Array:
    middle = np.array([0.0, 0.07, 0.0])
    return np.array([_unit(p - middle) for p in points])


def _unit(vector: Array) -> Array:
    unit: Array = vector / np.linalg.norm(vector)
    return unit
