"""How a measure of the face (the openness of an eye, the width of the mouth) becomes the weight of a blend shape.

The named curves are those of OpenVHead's BlendShapesController, whose weights go to 100 where ours go to 1; their
numbers can be tuned. Like there, a curve may go below 0 or above 1 or say nothing (NaN) for some measures: `Responses`
keeps the last weight then, and clamps, unless it is asked for OpenVHead's own weights.

In rig.toml, one line a shape::

    [responses]
    eyeBlinkLeft = { measure = "right_eye", curve = "blinkPiecewise", none = 0.25 }
    jawOpen = { measure = "mouth_width", curve = "ramp", start = 0.02, end = 0.3 }

Measures are ratios without unit, by the names that `retarget.camera.measures` gives them; the curves' own numbers are
for OpenVHead's four, `left_eye` (on the picture's left, so the performer's right), `right_eye`, `mouth_width` (from lip
to lip) and `mouth_length` (from corner to corner).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from retarget.rig.model import Rig
    from retarget.toml_table import Table

    Array = NDArray[np.float64]

Limits = Literal["clamped", "openvhead"]


class Curve(Protocol):
    """The weight for a measure; NaN where the last one stays."""

    def __call__(self, measure: float) -> float:
        """For a finite `measure`."""
        ...


@dataclass(frozen=True, slots=True)
class BlinkPiecewise:
    """1 below `full`, falling as 1 / measure to `half`, then straight to 0 at `none`; InputError unless they rise."""

    full: float = 0.05
    half: float = 0.1
    none: float = 0.2

    def __post_init__(self) -> None:
        if not 0 < self.full < self.half < self.none:
            raise InputError("A piecewise blink needs 0 < full < half < none.")

    def __call__(self, measure: float) -> float:
        """As `Curve`."""
        if measure < self.full:
            return 1.0
        if measure < self.half:
            return self.full / measure
        if measure < self.none:
            return self.full / self.half * (self.none - measure) / (self.none - self.half)
        return 0.0


@dataclass(frozen=True, slots=True)
class BlinkSigmoid:
    """1 - 1 / (1 + exp(-steepness (measure - middle)))."""

    middle: float = 0.12
    steepness: float = 500.0

    def __call__(self, measure: float) -> float:
        """As `Curve`."""
        return 0.5 - 0.5 * math.tanh(0.5 * self.steepness * (measure - self.middle))  # the same, and never overflows


@dataclass(frozen=True, slots=True)
class Shocked:
    """0 up to `start`, then rising by `gain` for every 1 of the measure, without end."""

    start: float = 0.25
    gain: float = 5.0

    def __call__(self, measure: float) -> float:
        """As `Curve`."""
        return self.gain * (measure - self.start) if measure > self.start else 0.0


@dataclass(frozen=True, slots=True)
class MouthWidth:
    """`gain` times the measure, at most 1: below 0 for a mouth that measures less than shut."""

    gain: float = 5.0

    def __call__(self, measure: float) -> float:
        """As `Curve`."""
        return min(self.gain * measure, 1.0)


@dataclass(frozen=True, slots=True)
class MouthLength:
    """`least` below `short`, then falling by `gain`, through 0 at `none`, up to `long`, where it says nothing any more.

    With OpenVHead's numbers it jumps from 0.5 to 0.8 at 0.1, and a mouth of 0.4 or more keeps what it had.
    """

    short: float = 0.1
    long: float = 0.4
    none: float = 0.3
    gain: float = 4.0
    least: float = 0.5

    def __post_init__(self) -> None:
        if not self.short < self.long:
            raise InputError("The length of a mouth needs short < long.")

    def __call__(self, measure: float) -> float:
        """As `Curve`."""
        if measure < self.short:
            return self.least
        return self.gain * (self.none - measure) if measure < self.long else math.nan


@dataclass(frozen=True, slots=True)
class Ramp:
    """Straight from 0 at `start` to 1 at `end`, whichever is larger."""

    start: float = 0.0
    end: float = 1.0

    def __post_init__(self) -> None:
        if self.start == self.end:
            raise InputError("A ramp needs a start and an end that differ.")

    def __call__(self, measure: float) -> float:
        """As `Curve`."""
        return min(max((measure - self.start) / (self.end - self.start), 0.0), 1.0)


@dataclass(frozen=True, slots=True)
class Response:
    """The measure that drives a shape, and how."""

    measure: str
    curve: Curve


CURVES: dict[str, type[BlinkPiecewise | BlinkSigmoid | Shocked | MouthWidth | MouthLength | Ramp]] = {
    "blinkPiecewise": BlinkPiecewise,
    "blinkSigmoid": BlinkSigmoid,
    "shocked": Shocked,
    "mouthWidth": MouthWidth,
    "mouthLength": MouthLength,
    "ramp": Ramp,
}
DEFAULTS = {
    "eyeBlinkLeft": Response("right_eye", BlinkPiecewise()),
    "eyeBlinkRight": Response("left_eye", BlinkPiecewise()),
    "eyeWideLeft": Response("right_eye", Shocked()),
    "eyeWideRight": Response("left_eye", Shocked()),
    "jawOpen": Response("mouth_width", MouthWidth()),
    "mouthPucker": Response("mouth_length", Ramp(start=0.3, end=0.05)),
}
"""For a rig that says nothing of responses and has ARKit's shapes."""


class Responses:
    """Weights of a rig's blend shapes from measures; it keeps the last ones."""

    def __init__(self, rig: Rig, limits: Limits = "clamped") -> None:
        """The responses of `rig`, or `DEFAULTS` for the shapes it has where it gives none; InputError where none fits.

        `limits` "openvhead" leaves weights as the curves give them.
        """
        given = rig.responses or {name: r for name, r in DEFAULTS.items() if name in rig.shape_names}
        if not given:
            raise InputError(
                f"The rig {rig.name!r} has no blend shape that a measure drives: name some in [responses] of its "
                f"rig.toml; without that, {', '.join(DEFAULTS)} are looked for."
            )
        self._driven = [(rig.shape_names.index(name), response) for name, response in given.items()]
        self._count, self._limits = len(rig.shape_names), limits
        self.measures = tuple(dict.fromkeys(response.measure for _, response in self._driven))
        """Names of the measures that are asked for."""
        self.reset()

    def measures_of(self, *curves: type[object]) -> tuple[str, ...]:
        """Names of the measures that a curve of one of these types is for."""
        found = (response.measure for _, response in self._driven if isinstance(response.curve, curves))
        return tuple(dict.fromkeys(found))

    def reset(self) -> None:
        """Forget the last weights: all are 0."""
        self._weights = np.zeros(self._count)

    def __call__(self, measures: Mapping[str, float]) -> Array:
        """Weights (B,), in [0, 1] unless `limits` says otherwise; what is NaN or not measured keeps its weight."""
        for shape, response in self._driven:
            measure = measures.get(response.measure, math.nan)
            weight = response.curve(measure) if math.isfinite(measure) else math.nan
            if math.isfinite(weight):
                self._weights[shape] = weight if self._limits == "openvhead" else min(max(weight, 0.0), 1.0)
        return self._weights.copy()


def read_responses(table: Table, shape_names: tuple[str, ...]) -> dict[str, Response]:
    """The [responses] of a rig file by shape; InputError, with the place, for what is unknown or wrong."""
    table.only(*shape_names)
    return {name: _response(table, name) for name in table.values}


def _response(responses: Table, shape: str) -> Response:
    table = responses.table(shape)
    name = table.string("curve")
    if name not in CURVES:
        raise table.wrong("curve", f"must be one of {', '.join(CURVES)}")
    numbers = [field.name for field in fields(CURVES[name])]
    table.only("measure", "curve", *numbers)
    try:
        curve = CURVES[name](**{key: table.number(key) for key in numbers if key in table.values})
    except InputError as error:
        raise responses.wrong(shape, f"cannot be used: {error}") from error
    return Response(table.string("measure"), curve)
