"""What the face does: known motion of the rig's joints, out of a few expressions, a talking jaw and a moving head.

`moves` are displacements of the sites in the rig's ``head`` [m] before the jaw carries them along; times in seconds.
All curves are smooth and below about 8 Hz, and every random one takes an rng.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget import geometry
from tests.synthetic.face import head_size

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from retarget.rig.model import Rig

    Array = NDArray[np.float64]

WIDE_OPEN_RAD = np.radians(25.0)
EXPRESSIONS_MM: dict[str, dict[str, tuple[float, float, float]]] = {
    "browsUp": {
        "browInner": (0, 7, 1),
        "browMid": (0.5, 9, 0),
        "browOuter": (1, 7, -1),
        "browCenter": (0, 5, 1),
        "forehead": (0, 3, 0),
        "lidUpper": (0, 2, -0.5),
    },
    "browsDown": {
        "browInner": (-3, -4, 1),
        "browMid": (-1, -4, 0.5),
        "browOuter": (0, -2, 0),
        "browCenter": (0, -3, 1),
        "noseBridge": (0, -0.5, 0.5),
    },
    "smile": {
        "lipCorner": (10, 7, -6),
        "lipUpper": (4.5, 2.5, -3.5),
        "lipLower": (4, 2, -3.5),
        "cheekUpper": (2, 5, 2),
        "cheekLower": (6, 4, 1),
        "cheekOuter": (2, 3, 0),
        "noseWing": (1.5, 1, -0.5),
        "lidLower": (0, 1.5, 0.5),
        "mandible": (2, 1, 0),
    },
    "pucker": {
        "lipCorner": (-9, 0.5, 4),
        "lipUpper": (-4, 0.5, 6),
        "lipLower": (-4, -0.5, 6),
        "cheekLower": (-3, 0, 1),
    },
    "squint": {
        "cheekUpper": (0, 3.5, 1),
        "lidLower": (0, 3, 0.5),
        "eyeOuter": (-0.5, 0, 0),
        "browOuter": (0, -1.5, 0),
    },
    "sneer": {"noseWing": (1, 4, 0), "lipUpper": (1, 4, 1), "cheekUpper": (0, 2, 1), "noseBridge": (0, 1, 0)},
    "press": {"lipUpper": (0, -1.2, -1), "lipLower": (0, 1.2, -1), "lipCorner": (0.5, 0, -0.5)},
    "blink": {"lidUpper": (0, -8, 1), "lidLower": (0, 1, 0)},
    "open": {
        "lipCorner": (-2, -7, -2),
        "lipUpper": (-0.5, -0.5, 0),
        "lipLower": (-1, 1, -1),
        "cheekLower": (-1, -5, -2),
        "cheekUpper": (0, -1.5, -0.5),
    },
}
"""Displacement [mm] at full strength of the site on the left; the right mirrors it, the middle has no sideways part.
"open" is what soft tissue does beside the jaw's own turn when it is wide open."""


@dataclass(frozen=True, slots=True, eq=False)
class FaceMotion:
    """How the rig's joints move."""

    times: Array
    """(T,) [s]."""
    sites: tuple[str, ...]
    moves: Array
    """(T, S, 3) [m], the rig's ``head``, before the jaw's turn."""
    jaw_rad: Array
    """(T,) turn of the rig's jaw."""
    T_world_head: Array
    """(T, 4, 4)."""


def smooth_noise(times: Array, rng: np.random.Generator, band_hz: tuple[float, float], rms: float) -> Array:
    """(T,): a sum of sinusoids of random phase with frequencies in the band; the same curve at any frame rate."""
    frequencies, phases = rng.uniform(*band_hz, 12), rng.uniform(0, 2 * np.pi, 12)
    waves: Array = np.sin(2 * np.pi * times[:, None] * frequencies + phases)
    noise: Array = rms * np.sqrt(2 / 12) * waves.sum(axis=1)
    return noise


def bump(times: Array, start: float, rise: float, hold: float, fall: float) -> Array:
    """(T,) from 0 to 1 and back, each way with the least jerk (Flash and Hogan 1985)."""
    return _ease((times - start) / rise) * (1 - _ease((times - start - rise - hold) / fall))


def _ease(x: Array) -> Array:
    x = np.clip(x, 0.0, 1.0)
    eased: Array = x**3 * (10 - 15 * x + 6 * x**2)
    return eased


def syllables(times: Array, rng: np.random.Generator, start: float, end: float) -> tuple[Array, Array, Array]:
    """Jaw (T,) in [0, 1], rounding (T,) in [-1, 1] and lip closure (T,) in [0, 1] of about five syllables a second."""
    jaw, rounding, closure = (np.zeros(len(times)) for _ in range(3))
    onset = start
    while onset < end - 0.3:
        length = rng.uniform(0.17, 0.28)
        jaw += rng.uniform(0.25, 1.0) * bump(times, onset, 0.5 * length, 0.0, 0.6 * length)
        rounding += rng.uniform(-0.8, 1.0) * bump(times, onset - 0.05, 0.6 * length, 0.0, 0.7 * length)
        if rng.random() < 0.35:
            closure += bump(times, onset - 0.09, 0.08, 0.02, 0.08)
        onset += length * rng.uniform(0.85, 1.15) + (0.25 if rng.random() < 0.12 else 0.0)
    return jaw, rounding, closure


def head_motion(times: Array, rng: np.random.Generator, strength: Array, turn_deg: Array | None = None) -> Array:
    """T_world_head (T, 4, 4): the small motion of a head that is alive, times `strength` (T,), in the room.

    `turn_deg` (T, 3) adds turns about x (nod), y (shake) and z (tilt).
    """
    degrees = np.stack([smooth_noise(times, rng, (0.15, 0.9), rms) for rms in (2.5, 4.0, 1.8)], axis=1)
    shift = np.stack([smooth_noise(times, rng, (0.1, 0.6), rms) for rms in (0.008, 0.004, 0.008)], axis=1)
    degrees = degrees * strength[:, None] + (0.0 if turn_deg is None else turn_deg)
    quats = np.array([0.0, 0.0, 0.0, 1.0])
    for axis, angle in zip(np.eye(3), np.radians(degrees).T, strict=True):
        quats = geometry.quat_multiply(geometry.quat_from_axis_angle(axis, angle), quats)
    stance = geometry.matrix_from_quat(geometry.quat_from_axis_angle([0.0, 1.0, 0.0], 0.3))
    return geometry.transform(stance @ geometry.matrix_from_quat(quats), [0.4, 1.55, -0.2] + shift * strength[:, None])


def face_motion(
    rig: Rig, times: Array, strengths: Mapping[str, Array], jaw_rad: Array, T_world_head: Array
) -> FaceMotion:
    """The motion of all sites of `rig` from the strengths of the expressions; "open" follows the jaw by itself.

    A strength is (T,), or (T, 2) for the left and the right apart.
    """
    sites = tuple(rig.sites)
    moves = np.zeros((len(times), len(sites), 3))
    for name, strength in {**strengths, "open": jaw_rad / WIDE_OPEN_RAD}.items():
        sides = np.broadcast_to(strength.reshape(len(times), -1), (len(times), 2))
        patterns = np.stack([_pattern(rig, name, side) for side in ("Left", "Right")])
        moves += np.einsum("tk,ksx->tsx", sides, patterns)
    return FaceMotion(times, sites, moves, jaw_rad, T_world_head)


def _pattern(rig: Rig, expression: str, side: str) -> Array:
    """(S, 3) [m] what one side's muscles do: all of the sites there, half of those in the middle."""
    _, size = head_size(rig)
    mirror = np.array([1.0 if side == "Left" else -1.0, 1.0, 1.0])
    rows = np.zeros((len(rig.sites), 3))
    for row, site in zip(rows, rig.sites, strict=True):
        middle = not site.endswith(("Left", "Right"))
        if middle or site.endswith(side):
            move = EXPRESSIONS_MM[expression].get(site.removesuffix(side), (0, 0, 0))
            row[:] = 1e-3 * size * mirror * move * (0.5 if middle else 1.0)
    return rows


def everything(rig: Rig, times: Array, rng: np.random.Generator) -> FaceMotion:
    """All at once, for tests: speech, every expression to and fro, every site a little on its own, the head in motion.

    The sites at the chin have no motion but the jaw's, so that its turn is what the chin shows.
    """
    jaw, rounding, closure = syllables(times, rng, times[0], times[-1])
    strengths = {name: smooth_noise(times, rng, (0.2, 1.5), 0.35) for name in EXPRESSIONS_MM if name != "open"}
    strengths |= {"pucker": strengths["pucker"] + 0.4 * rounding, "press": closure}
    slow_jaw = np.abs(smooth_noise(times, rng, (0.1, 0.5), 0.15))
    motion = face_motion(
        rig, times, strengths, WIDE_OPEN_RAD * (0.4 * jaw + slow_jaw), head_motion(times, rng, np.ones(len(times)))
    )
    for i, site in enumerate(motion.sites):
        own = [smooth_noise(times, rng, (0.2, 3.0), 0.001) for _ in range(3)]
        motion.moves[:, i] = 0.0 if site.startswith("chin") else motion.moves[:, i] + np.stack(own, axis=1)
    return motion
