"""What other programs answered for the carphone clip; tests that need it skip where it is absent."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

if TYPE_CHECKING:
    from numpy.typing import NDArray

ORACLES = Path(__file__).parents[2] / "../shared/data/oracles"
OPENVHEAD_SIZE = (528, 432)


def openvhead() -> tuple[NDArray[np.float64], list[str]]:
    """Landmarks (117, 68, 2) that OpenVHead's detector gave, and the 117 messages that it sent for them."""
    recorded: dict[str, Any] = json.loads(_oracle("openvhead_carphone.json").read_text())
    return np.array(recorded["landmarks"], float), recorded["messages"]


def mediapipe() -> dict[str, NDArray[Any]]:
    """Landmarks, blend shapes and transforms that mediapipe gave for the 120 frames."""
    with np.load(_oracle("mediapipe_carphone.npz")) as recorded:
        return dict(recorded)


def _oracle(name: str) -> Path:
    path = ORACLES / name
    if not path.exists():
        pytest.skip(f"the recording {name} is not here")
    return path
