"""How near a calibration comes to a synthetic performer of whom everything is known.

The head's axes of the calibration and of the truth differ by what the shape of a face leaves open, so directions and
places are compared after both neutrals were laid onto each other. K is told where the rig goes by `TOLD_M` or more
along the axis, ten times the noise: what the rig never does there, no performance can tell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.calibration import Settings, calibrate
from calib.fixed import by_direction
from calib.material import Material, RangeTake
from calib.neutral import find_neutral
from calib.recording import Recording
from retarget import geometry
from retarget.rig.jaw import jaw_reader
from tests.synthetic.rom import neutral_take, person, range_of_motion, rough

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from calib.calibration import Calibration
    from retarget.frames import MarkerLayout
    from retarget.rig.model import Rig
    from tests.synthetic.capture import SyntheticTake
    from tests.synthetic.face import SyntheticFace

    Array = NDArray[np.float64]

TOLD_M = 0.003
HARDLY_TOLD_M = 0.001


@dataclass(frozen=True, slots=True, eq=False)
class Recovery:
    """Errors of one calibration."""

    K: Array
    """Relative, of every value that the rig's range tells."""
    K_small: Array
    """Relative, of those where the rig goes by 1 to 3 mm."""
    axis_deg: float
    pivot_m: float
    """Distance between both hinges at the middle of the face."""
    gain: float
    """Relative."""
    angle_deg: Array
    """(T,) of the jaw while it opens and talks, read from noise-free markers."""
    noisy_angle_deg: Array
    """(T,) the same from markers with 0.3 mm of noise."""
    calibration: Calibration


def recording(name: str, take: SyntheticTake) -> Recording:
    return Recording(name, take.layout, take.times, take.p_world)


def calibrated(
    face: SyntheticFace, neutral: SyntheticTake, rom: SyntheticTake, settings: Settings | None = None
) -> Calibration:
    still = find_neutral(recording("neutral", neutral))
    takes = (RangeTake(recording("rom", rom)),)
    return calibrate(Material(still, takes), face.layout, face.rig, settings or Settings())


def recovered(rig: Rig, layout: MarkerLayout, seed: int, rate_hz: float = 120.0) -> Recovery:
    """A performer of that seed, recorded on a bad day and calibrated, against the truth."""
    rng = np.random.default_rng(seed)
    face = person(rig, layout, rng)
    neutral = rough(neutral_take(face, rng, rate_hz), rng)
    rom = rough(range_of_motion(face, rng, rate_hz), rng)
    calibration = calibrated(face, neutral, rom)
    talk = range_of_motion(face, rng, 60.0, only=["jawOpen"])
    return compared(face, calibration, talk, rng)


def compared(face: SyntheticFace, calibration: Calibration, talk: SyntheticTake, rng: np.random.Generator) -> Recovery:
    found, true = calibration.performer, face.performer
    assert found.jaw is not None
    assert true.jaw is not None
    T_found_true = geometry.kabsch(true.neutral, found.neutral)
    axis = T_found_true[:3, :3].T @ found.jaw.axis
    pivot = geometry.apply(geometry.inverse(T_found_true), found.jaw.pivot[None])[0]
    across = pivot - true.jaw.pivot + (true.jaw.pivot[0] - pivot[0]) / axis[0] * axis
    p_head = np.array([frame.positions for frame in talk.stabilised()])
    return Recovery(
        K=_gain_errors(face, calibration, TOLD_M, np.inf),
        K_small=_gain_errors(face, calibration, HARDLY_TOLD_M, TOLD_M),
        axis_deg=float(np.degrees(np.arccos(min(1.0, float(axis @ true.jaw.axis))))),
        pivot_m=float(np.linalg.norm(across)),
        gain=found.jaw.gain / true.jaw.gain - 1,
        angle_deg=_angle_errors(calibration, T_found_true, talk, p_head),
        noisy_angle_deg=_angle_errors(
            calibration, T_found_true, talk, p_head + rng.normal(scale=3e-4, size=p_head.shape)
        ),
        calibration=calibration,
    )


def _gain_errors(face: SyntheticFace, calibration: Calibration, least_m: float, most_m: float) -> Array:
    names = calibration.face.names
    true, found = (
        np.stack([by_direction(p.K[name]) for name in names], 1) for p in (face.performer, calibration.performer)
    )
    reach = np.abs(calibration.rig_seen)
    return (found / true - 1)[(reach >= least_m) & (reach < most_m)]


def _angle_errors(calibration: Calibration, T_found_true: Array, talk: SyntheticTake, p_true: Array) -> Array:
    performer = calibration.performer
    assert performer.jaw is not None
    chin = calibration.face.markers[calibration.face.chin]
    read = jaw_reader(performer.jaw, performer.neutral[chin])
    p_found = p_true[:, chin] @ T_found_true[:3, :3].T + T_found_true[:3, 3]
    return np.degrees(np.array([read(p) for p in p_found]) - talk.performer_jaw_rad)
