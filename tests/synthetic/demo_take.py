"""The bundled take: ten seconds at 120 Hz of a performer with 24 markers, made and not recorded, so free to ship.

A still second, brows, a smile, speech, a wide open mouth, all with a head that moves. The same take every time:
``python -m tests.synthetic.demo_take takes/demo.c3d``. World axes: +Y up, +Z towards the cameras; the file has mm.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from retarget.performer import gain_matrix
from tests.synthetic.capture import captured, with_dropouts, with_noise
from tests.synthetic.face import face_layout, make_face
from tests.synthetic.motion import WIDE_OPEN_RAD, bump, face_motion, head_motion, syllables
from tests.synthetic.rig import small_rig

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.synthetic.capture import SyntheticTake
    from tests.synthetic.motion import FaceMotion

    Array = NDArray[np.float64]

RATE_HZ = 120.0
SECONDS = 10.0
STILL_S = 1.0
SEED = 20


def demo_take() -> SyntheticTake:
    """The performance as the cameras saw it."""
    rng = np.random.default_rng(SEED)
    face = make_face(small_rig(), face_layout(), rng)
    whole = {site: gain_matrix(face.performer.scale) for site in face.performer.K}  # no default K exaggerates or damps
    jaw = None if face.performer.jaw is None else replace(face.performer.jaw, gain=1.0)
    face = replace(face, performer=replace(face.performer, K=whole, jaw=jaw))
    take = with_noise(captured(face, _performance(rng)), rng, 0.0001)
    return with_dropouts(take, rng, 0.004, still_s=STILL_S)


def _performance(rng: np.random.Generator) -> FaceMotion:
    t = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    jaw, rounding, closure = syllables(t, rng, 4.5, 7.6)
    brows, smile, wide = bump(t, 1.1, 0.3, 0.6, 0.4), bump(t, 2.5, 0.45, 0.9, 0.5), bump(t, 8.0, 0.4, 0.55, 0.45)
    accents = sum(bump(t, at, 0.15, 0.1, 0.35) for at in (4.7, 5.9, 7.1))
    afterglow = bump(t, 7.5, 0.3, 0.0, 0.3) + bump(t, 9.35, 0.3, 0.2, 0.14)
    strengths = {
        "browsUp": _sides(1.3 * brows + 0.6 * accents + 0.7 * wide, 1.0, 0.9),
        "browsDown": 0.35 * bump(t, 6.2, 0.3, 0.3, 0.3),
        "smile": _sides(1.3 * smile + 0.3 * afterglow, 0.93, 1.0) + 0.4 * np.maximum(-rounding, 0.0)[:, None],
        "squint": _sides(smile, 1.0, 0.9),
        "pucker": 0.9 * np.maximum(rounding, 0.0),
        "press": closure,
    }
    jaw_rad = np.radians(15.0) * jaw + 0.95 * WIDE_OPEN_RAD * wide + np.radians(1.5) * smile
    nod, shake, tilt = -4 * brows - 7 * wide + 3 * accents, 5 * bump(t, 4.4, 0.8, 1.5, 0.9), 5 * smile
    alive = bump(t, STILL_S, 0.6, SECONDS, 1.0)
    T_world_head = head_motion(t, rng, alive, np.stack([nod, shake, tilt], axis=1))
    return face_motion(small_rig(), t, strengths, jaw_rad, T_world_head)


def _sides(strength: Array, left: float, right: float) -> Array:
    """(T, 2) of (T,): no face is quite even."""
    sides: Array = strength[:, None] * np.array([left, right])
    return sides


def write_c3d(take: SyntheticTake, path: Path) -> None:
    """The take as a C3D file in millimetres, with a negative residual where a marker was not seen."""
    import ezc3d

    seen = np.isfinite(take.p_world).all(axis=2)
    points = np.ones((4, take.p_world.shape[1], take.p_world.shape[0]))
    points[:3] = np.nan_to_num(1000 * take.p_world).transpose(2, 1, 0)
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [RATE_HZ]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(take.layout.names)
    file["data"]["points"] = points
    file["data"]["meta_points"]["residuals"] = np.where(seen, 0.0, -1.0).T[None]
    file.write(str(path))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m tests.synthetic.demo_take takes/demo.c3d")
    write_c3d(demo_take(), Path(sys.argv[1]))
