"""Draws the markers of a layout on the default rig: `python docs/draw_layout.py face24 docs/face24.png`.

Face markers stand at the rig's sites, head-band markers where a band sits; left and right are the performer's.
"""

from __future__ import annotations

import sys

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from retarget.geometry import apply, inverse
from retarget.markers.layouts import load_layout
from retarget.rig.display.camera import camera_for
from retarget.rig.display.offscreen import Offscreen
from retarget.rig.display.view import View
from retarget.rig.load import load_rig
from retarget.rig.posing import rest_pose

VIEW = View(width=1100, height=900, background=(58, 66, 74), framing="head", supersampling=3)
BAND_M = {  # on the rig's head, in `head`: a band above the brows
    "headFrontLeft": (0.048, 0.098, 0.085),
    "headFrontRight": (-0.048, 0.098, 0.085),
    "headBackLeft": (0.062, 0.106, 0.035),
    "headBackRight": (-0.062, 0.106, 0.035),
}
DOT, BAND = (255, 214, 64), (96, 200, 255)


def main(name: str, target: str) -> None:
    """Draw the layout `name` to the file `target`."""
    rig, markers = load_rig("human"), load_layout(name).markers
    places = {n: rig.sites[s].rest for n, s in zip(markers.names, markers.sites, strict=True) if s}
    places |= {n: np.array(BAND_M[n]) for n in markers.names if n in BAND_M}
    with Offscreen(rig, VIEW) as display:
        picture = Image.fromarray(display.render(rest_pose(rig)))
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(15)
    origin = rig.joints.T_rig_joint[rig.head_joint, :3, 3]
    pixels = projected(np.array(list(places.values())) + origin, rig)
    for side in (-1, 1):
        rows = [(n, p) for n, p in zip(places, pixels, strict=True) if (p[0] > VIEW.width / 2 - 1) == (side > 0)]
        label_column(pen, font, sorted(rows, key=lambda row: row[1][1]), side)
    picture.save(target)


def projected(p_rig: np.ndarray, rig: object) -> np.ndarray:
    """(N, 2) [pixel] of points in ``rig``."""
    camera = camera_for(rig, VIEW)  # type: ignore[arg-type]
    p = apply(inverse(camera.T_rig_camera), p_rig)
    focal = VIEW.height / 2 / np.tan(camera.yfov_rad / 2)
    return np.stack([VIEW.width / 2 + focal * p[:, 0] / -p[:, 2], VIEW.height / 2 + focal * p[:, 1] / p[:, 2]], axis=1)


def label_column(
    pen: ImageDraw.ImageDraw,
    font: ImageFont.FreeTypeFont | ImageFont.ImageFont,
    rows: list[tuple[str, np.ndarray]],
    side: int,
) -> None:
    """Dots, and their names in a column at the picture's edge, a line from each name to its dot."""
    heights = np.linspace(60, VIEW.height - 60, len(rows))
    for (name, (x, y)), height in zip(rows, heights, strict=True):
        colour = BAND if name in BAND_M else DOT
        edge = 150 if side < 0 else VIEW.width - 150
        pen.line([(edge, height), (x, y)], fill=(200, 205, 210), width=1)
        pen.ellipse([x - 6, y - 6, x + 6, y + 6], fill=colour, outline=(30, 30, 30))
        pen.text((edge - 6 * np.sign(-side), height), name, fill=colour, font=font, anchor="rm" if side < 0 else "lm")


if __name__ == "__main__":
    main(*sys.argv[1:])
