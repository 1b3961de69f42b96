"""The colours of the skin: tone, blush, lips, brows, cropped hair, the rims of the lids, the inside of the mouth.

Colours and lines are those of a `Palette`. Places are metres from the middle between the eyes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from rigs.recipe.noise import fractal, value_noise
from rigs.recipe.paint import blend, smoothstep

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.palette import Palette

    Field = NDArray[np.float64]

HAIR_LINE_DEG_M = (
    # (angle about the vertical through the skull, height of the hairline)
    (0, 0.0635), (12, 0.0640), (24, 0.0665), (34, 0.0650), (44, 0.0570), (52, 0.0450),  # forehead and temple
    (58, 0.0380), (64, 0.0300), (69, 0.0100), (74, -0.0140), (84, -0.0160),  # whiskers
    (92, -0.0100), (112, -0.0120), (125, -0.0300), (150, -0.0520), (180, -0.0580),  # above the ear, nape
)  # fmt: skip
SKULL_BEHIND_M = 0.075
EAR_UV = ((0.8434, 0.6305), (0.8434, 0.3365))
"""Middles of the ears in MakeHuman's layout."""


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """What the painter knows about each of N texels."""

    place: Field
    """(N, 3) [m] from the middle between the eyes."""
    openness: Field
    """(N,) in [0, 1], light from all around."""
    lips: Field
    """(N,) in [0, 1], how much of it is the red of the lips."""
    source_uv: Field
    """(N, 2) in MakeHuman's layout."""
    mouth_m: Field
    """(N,) depth inside the mouth along the surface, 0 outside."""
    rim_m: Field
    """(N,) distance from the inner rims of the lids along the surface [m]."""
    socket: Field
    """(N,) 1 behind the lids, else 0."""
    outside: Field
    """(N,) 1 on the front of the head, 0 behind and inside: where brows may grow."""


def complexion(ground: Ground, spots: dict[str, Field], palette: Palette) -> Field:
    """Colours (N, 3); `spots` gives places of sites, in the frame of `ground.place`."""
    skin = _tone(ground, palette)
    skin = _flush(skin, ground, spots, palette)
    skin = _freckles(skin, ground, spots, palette)
    skin = _around_eyes(skin, ground, spots, palette)
    skin = _lips(skin, ground, palette)
    skin = _hair(skin, ground, palette)
    skin = _brows(skin, ground, palette)
    skin = _hollows(skin, ground, palette)
    return _inside(skin, ground, palette)


def _near(ground: Ground, spot: Field, radii_mm: tuple[float, float, float]) -> Field:
    """A soft ellipsoid about `spot` and its mirror image: 1 in the middle, 0.37 at the radii."""
    mirrored = np.abs(ground.place) * [1, 0, 0] + ground.place * [0, 1, 1]
    away = (mirrored - np.abs(spot) * [1, 0, 0] - spot * [0, 1, 1]) / (np.array(radii_mm) * 1e-3)
    return np.asarray(np.exp(-(away**2).sum(-1)))


def _tone(ground: Ground, palette: Palette) -> Field:
    place = ground.place * 1e3
    broad = fractal(place, 38, 3, seed=11)
    mottled = fractal(place, 7, 3, seed=21)
    pores = value_noise(place, 0.9, seed=31)
    warmth = fractal(place, 24, 2, seed=41)
    skin = np.array(palette.tone) * (1 + palette.texture * (0.018 * broad + 0.016 * mottled + 0.012 * pores))[:, None]
    return skin + warmth[:, None] * [1.5, -2.0, -2.5]


def _flush(skin: Field, ground: Ground, spots: dict[str, Field], palette: Palette) -> Field:
    cheek = spots["cheekUpperLeft"] + [0.002, -0.006, 0]
    patchy = 1 + 0.3 * fractal(ground.place * 1e3, 11, 3, seed=51)
    redness = 0.42 * _near(ground, cheek, (19, 15, 26))
    redness += 0.40 * _near(ground, spots["noseTip"] + [0, -0.002, -0.004], (12, 11, 16))
    redness += 0.20 * _near(ground, spots["noseWingLeft"], (7, 8, 10))
    redness += 0.20 * _near(ground, spots["chin"], (14, 10, 16))
    redness += 0.45 * _ears(ground.source_uv)
    redness += 0.10 * _near(ground, spots["forehead"], (40, 18, 30))
    pale = 0.10 * _near(ground, spots["browCenter"] + [0, 0.012, 0], (22, 14, 20))
    return blend(blend(skin, palette.flush, redness * patchy), palette.pale, pale)


def _ears(source_uv: Field) -> Field:
    away = np.min([np.linalg.norm(source_uv - middle, axis=1) for middle in EAR_UV], axis=0)
    return smoothstep(0.030, 0.020, away)


def _freckles(skin: Field, ground: Ground, spots: dict[str, Field], palette: Palette) -> Field:
    place = ground.place * 1e3
    where = _near(ground, spots["cheekUpperLeft"], (20, 12, 26)) + _near(ground, spots["noseBridge"], (13, 12, 16))
    place = place + 0.9 * np.stack([value_noise(place, 2.3, seed=k) for k in (57, 58, 59)], axis=1)
    dots = smoothstep(0.40, 0.62, value_noise(place, 1.7, seed=55)) + smoothstep(0.55, 0.7, value_noise(place, 1.1, 56))
    return blend(skin, palette.shade, palette.freckles * dots * np.clip(where, 0, 1))


def _around_eyes(skin: Field, ground: Ground, spots: dict[str, Field], palette: Palette) -> Field:
    below = _near(ground, spots["lidLowerLeft"] + [-0.004, -0.005, 0], (14, 4.5, 12))
    inner = _near(ground, spots["eyeInnerLeft"] + [-0.001, 0.0, 0], (5, 7, 8))
    above = _near(ground, spots["lidUpperLeft"] + [0.0, 0.0005, 0], (15, 5, 10))
    skin = blend(skin, palette.below_eye, 0.34 * below + 0.30 * inner)
    skin = blend(skin, palette.above_eye, 0.36 * above)
    rim = smoothstep(0.0050, 0.0028, ground.rim_m)
    skin = blend(skin, palette.lid_rim, 0.8 * rim)
    upper = smoothstep(-0.002, 0.001, ground.place[:, 1])
    lash_line = smoothstep(0.0058, 0.0044, ground.rim_m) * smoothstep(0.0026, 0.0038, ground.rim_m)
    return blend(skin, palette.lash_line, lash_line * (0.25 + 0.6 * upper))


def _lips(skin: Field, ground: Ground, palette: Palette) -> Field:
    place = ground.place * 1e3
    creases = value_noise(place * [1, 0.12, 0.3], 0.8, seed=61)
    softness = smoothstep(0.25, 0.85, ground.lips + 0.05 * value_noise(place, 1.2, seed=62))
    colour = np.array(palette.lip) * (1 + 0.035 * creases + 0.03 * fractal(place, 5, 2, seed=63))[:, None]
    return blend(skin, colour, 0.85 * softness)


def above_hairline(place: Field) -> Field:
    """(N,) [m], negative on bare skin."""
    x, y, z = place.T
    angle = np.degrees(np.arctan2(np.abs(x), z + SKULL_BEHIND_M))
    line = np.array(HAIR_LINE_DEG_M, dtype=float)
    return np.asarray(y - np.interp(angle, line[:, 0], line[:, 1]))


def hair_cover(place: Field, source_uv: Field) -> Field:
    """(N,) 1 where the hair of the head grows, 0 on bare skin; places (N, 3) [m] from the middle between the eyes."""
    return smoothstep(0.0, 0.022, above_hairline(place)) * (1 - _ears(source_uv))


def _hair(skin: Field, ground: Ground, palette: Palette) -> Field:
    place = ground.place * 1e3
    above = (
        above_hairline(ground.place) * 1e3
        + 2.4 * fractal(place, 8, 3, seed=71)
        + 3.0 * value_noise(place, 0.8, seed=75)
    )
    cover = smoothstep(-3.0, 11.0, above) * (1 - _ears(ground.source_uv))
    strands = 0.55 * value_noise(place * [1, 0.35, 1], 0.8, seed=81) + 0.45 * value_noise(place, 1.9, seed=82)
    light = 1 + 0.30 * strands + 0.12 * fractal(place, 25, 2, seed=83)
    return blend(skin, np.array(palette.hair) * light[:, None], 0.93 * cover)


def _brows(skin: Field, ground: Ground, palette: Palette) -> Field:
    line = np.array(palette.brow_line_m) * 1e3
    steps = np.linspace(0, len(line) - 1, 200)
    middle = np.stack([np.interp(steps, np.arange(len(line)), line[:, k]) for k in range(2)], axis=1)
    middle = np.stack(
        [np.convolve(np.pad(row, 12, "reflect", reflect_type="odd"), np.ones(25) / 25, "valid") for row in middle.T],
        axis=1,
    )
    run = np.r_[0, np.cumsum(np.linalg.norm(np.diff(middle, axis=0), axis=1))]
    half = np.interp(steps, np.arange(len(line)), palette.brow_half_mm)
    x, y = np.abs(ground.place[:, 0]) * 1e3, ground.place[:, 1] * 1e3
    nearest = cKDTree(middle).query(np.stack([x, y], axis=1))[1]
    tangent = np.gradient(middle, axis=0)[nearest]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    offset = np.stack([x, y], axis=1) - middle[nearest]
    along = run[nearest] + (offset * tangent).sum(1)
    across = tangent[:, 0] * offset[:, 1] - tangent[:, 1] * offset[:, 0]
    length = run[-1]
    lean = np.radians(np.interp(along / length, [0, 0.25, 0.6, 1], [62, 34, 14, -8]))
    side = np.where(ground.place[:, 0] > 0, 0.0, 40.0)
    strand = np.stack(
        [across * np.cos(lean) - along * np.sin(lean), (along * np.cos(lean) + across * np.sin(lean)) * 0.13, side],
        axis=1,
    )
    hairs = value_noise(strand, 0.40, seed=91) * 0.6 + value_noise(strand, 0.75, seed=92) * 0.4
    depth = 1 - np.abs(across) / half[nearest]
    ends = smoothstep(-2.5, 7.0, along) * smoothstep(length + 1.5, length - 6, along)
    body = smoothstep(-0.45, 0.55, depth + 0.55 * hairs) * ends
    cover = body * (0.72 + 0.28 * smoothstep(-0.5, 0.5, hairs)) * ground.outside
    return blend(skin, np.array(palette.brow) * (1 + 0.2 * hairs)[:, None], 0.88 * cover)


def _hollows(skin: Field, ground: Ground, palette: Palette) -> Field:
    """Less light and a redder one where the skin lies hidden: nostrils, ears, lids, the line between the lips."""
    hidden = smoothstep(0.80, 0.10, ground.openness) * (1 - 0.35 * smoothstep(0.3, 0.8, ground.lips))
    return skin * (1 - hidden[:, None] * (1 - np.array(palette.shade) / 255) * 0.85)


def _inside(skin: Field, ground: Ground, palette: Palette) -> Field:
    depth = ground.mouth_m
    skin = blend(skin, palette.gums, smoothstep(0.0, 0.002, depth))
    skin = blend(skin, palette.gullet, smoothstep(0.003, 0.018, depth))
    return blend(skin, palette.socket, ground.socket)
