"""The colours of a head and the lines between them: skin, lips, brows, hair, eyes.

All colours are sRGB in [0, 255]. Places are metres from the middle between the eyes, on the face of the default
identity: other faces are painted where the same vertices of the base mesh are.
"""

from __future__ import annotations

from dataclasses import dataclass

Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Palette:
    """What the painter needs to know of a person; the defaults are those of the default rig."""

    tone: Colour = (214.0, 168.0, 142.0)
    pale: Colour = (226.0, 186.0, 158.0)
    flush: Colour = (204.0, 128.0, 112.0)
    lip: Colour = (188.0, 113.0, 103.0)
    shade: Colour = (112.0, 62.0, 50.0)
    hair: Colour = (58.0, 43.0, 34.0)
    brow: Colour = (62.0, 44.0, 34.0)
    below_eye: Colour = (178.0, 128.0, 118.0)
    above_eye: Colour = (176.0, 120.0, 104.0)
    lid_rim: Colour = (196.0, 132.0, 118.0)
    lash_line: Colour = (70.0, 42.0, 36.0)
    socket: Colour = (150.0, 84.0, 78.0)
    gullet: Colour = (44.0, 12.0, 14.0)
    gums: Colour = (150.0, 74.0, 74.0)
    iris_outer: Colour = (62.0, 74.0, 78.0)
    iris_inner: Colour = (128.0, 104.0, 70.0)
    eye_white: Colour = (208.0, 201.0, 195.0)
    texture: float = 1.0
    """Strength of mottles and pores."""
    freckles: float = 0.0
    """Opacity of freckles on nose and cheeks."""
    brow_line_m: tuple[tuple[float, float], ...] = (
        (0.0125, 0.0150),
        (0.0180, 0.0178),
        (0.0260, 0.0208),
        (0.0340, 0.0222),
        (0.0410, 0.0198),
        (0.0465, 0.0150),
    )
    """(x, y) of the left brow's middle line, from the nose outwards."""
    brow_half_mm: tuple[float, ...] = (2.6, 3.5, 3.6, 3.1, 2.2, 0.8)
    """Half the width of the brow at each of these."""
