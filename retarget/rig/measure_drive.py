"""From measures of a face to the weights of a rig's shapes: a smoother per measure, then the rig's response curves.

As OpenVHead drives its models: the measures, not the weights, go through the PD controlled mass, and the blink trick
belongs to the measures that shut an eye. "openvhead-1" and "openvhead-2" are its two models with every number of
theirs: one update a call, stale states, weights that are not clamped. The others take the true time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple, get_args

import numpy as np

from retarget.errors import InputError
from retarget.filters import BlinkTrick, OneEuro, PdGains, PdMass, SteppedPdMass
from retarget.rig.responses import BlinkPiecewise, BlinkSigmoid, Responses

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from retarget.filters import Filter
    from retarget.rig.model import Rig

    Array = NDArray[np.float64]

MeasureSmoothing = Literal["pd", "one-euro", "none", "openvhead-1", "openvhead-2"]
BETA = 20.0
"""Of the One-Euro filter: measures range over some 0.2."""
START = {"left_eye": 0.2, "right_eye": 0.2, "mouth_width": 0.03, "mouth_length": 0.45}
"""Where OpenVHead's controllers start."""


class _Model(NamedTuple):
    """The numbers of one of OpenVHead's models."""

    eyes: PdGains
    mouth: PdGains
    shut_below: float


MODELS: dict[str, _Model] = {
    "openvhead-1": _Model(PdGains(mass=1.0, alpha=0.8), PdGains(mass=1.0, alpha=0.7), 0.07),
    "openvhead-2": _Model(PdGains(mass=2.0, alpha=0.8), PdGains(mass=1.0, alpha=0.7), 0.05),
}


class MeasureDrive:
    """Weights of one rig from measures that come one set at a time."""

    def __init__(self, rig: Rig, smooth: MeasureSmoothing = "one-euro") -> None:
        """InputError for a smoothing that there is not, and where no measure drives `rig`."""
        if smooth not in get_args(MeasureSmoothing):
            raise InputError(
                f"There is no smoothing of measures called {smooth!r}; there are: "
                f"{', '.join(get_args(MeasureSmoothing))}."
            )
        self._responses = Responses(rig, "openvhead" if smooth in MODELS else "clamped")
        self.measures = self._responses.measures
        """Names of the measures that are asked for."""
        blinks = self._responses.measures_of(BlinkPiecewise, BlinkSigmoid)
        self._parts = _parts(self.measures, blinks, smooth)

    def reset(self) -> None:
        """Forget all earlier measures."""
        self._responses.reset()
        for _, smoother in self._parts:
            smoother.reset()

    def __call__(self, measures: Mapping[str, float], time_s: float) -> Array:
        """Weights (B,) for `measures` at `time_s` [s]; what is NaN or not measured keeps its weight."""
        smooth = dict(measures)
        for names, smoother in self._parts:
            values = smoother(np.array([measures.get(name, np.nan) for name in names]), time_s)
            smooth.update(zip(names, values.tolist(), strict=True))
        return self._responses(smooth)


def _parts(
    measures: tuple[str, ...], blinks: tuple[str, ...], smooth: MeasureSmoothing
) -> list[tuple[tuple[str, ...], Filter]]:
    """The smoothers, each with the names of its measures."""
    if smooth == "none":
        return []
    if smooth == "one-euro":
        return [(measures, OneEuro(beta=BETA))]
    others = tuple(name for name in measures if name not in blinks)
    model = MODELS.get(smooth, MODELS["openvhead-1"])
    if smooth == "pd":
        return [
            (blinks, BlinkTrick(PdMass(model.eyes, floor=0.0), model.shut_below)),
            (others, PdMass(model.mouth, floor=0.0)),
        ]
    eyes, mouth = (np.array([START.get(name, 0.0) for name in names]) for names in (blinks, others))
    return [
        (blinks, BlinkTrick(SteppedPdMass(model.eyes, eyes), model.shut_below, after="stale")),
        (others, SteppedPdMass(model.mouth, mouth)),
    ]
