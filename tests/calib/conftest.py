"""What several tests of calibration use: the shipped rig, and one performer calibrated from a rough recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.rig.load import load_rig
from tests.calib.truth import calibrated
from tests.synthetic.face import ALL_SITES, face_layout
from tests.synthetic.rom import neutral_take, person, range_of_motion, rough

if TYPE_CHECKING:
    from calib.calibration import Calibration
    from retarget.rig.model import Rig
    from tests.synthetic.face import SyntheticFace


@pytest.fixture(scope="session")
def human() -> Rig:
    return load_rig("human")


@pytest.fixture(scope="session")
def found(human: Rig) -> tuple[SyntheticFace, Calibration]:
    """A performer and its calibration, from everything but a smile of the left side and any pucker."""
    rng = np.random.default_rng(11)
    face = person(human, face_layout("all", ALL_SITES), rng)
    names = ["jawOpen", "jawLeft", "jawForward", "smile", "browsUp", "browsDown", "cheeks", "nose"]
    rom = rough(range_of_motion(face, rng, 60.0, names, still_sides={"smile": "Left"}), rng)
    return face, calibrated(face, rough(neutral_take(face, rng, 60.0), rng), rom)
