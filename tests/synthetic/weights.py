"""A performer whose truth is weights: the rig's own shapes move the markers, in expressions, speech and blinks.

Markers are where the rig's sites are, displaced by B w in the rig's ``head`` [m], so that the true weights (T, B) are
known. Seen by imperfect cameras: noise, dropouts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tests.synthetic.motion import bump, smooth_noise, syllables

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from retarget.rig.expressions import Expression
    from retarget.rig.site_shapes import SiteShapes

    Array = NDArray[np.float64]

PROTOTYPES: dict[Expression, dict[str, float]] = {
    "neutral": {},
    "joy": {"mouthSmile": 0.9, "cheekSquint": 0.6, "eyeSquint": 0.4, "mouthDimple": 0.3},
    "anger": {"browDown": 0.9, "noseSneer": 0.5, "mouthPress": 0.5, "eyeSquint": 0.5, "mouthFrown": 0.15},
    "sorrow": {"browInnerUp": 0.7, "mouthFrown": 0.8, "mouthShrugLower": 0.4, "eyeSquint": 0.2, "browDown": 0.1},
    "surprise": {"browInnerUp": 0.7, "browOuterUp": 0.9, "eyeWide": 0.8, "jawOpen": 0.4},
}
"""How strong each shape is in a full expression, as actors are asked for them; everyone strays from it."""


@dataclass(frozen=True, slots=True, eq=False)
class Performance:
    """What was played."""

    times: Array
    """(T,) [s]."""
    weights: Array
    """(T, B)."""
    labels: tuple[Expression, ...]
    """(T,) which expression is meant; "neutral" too while one comes or goes and is still weak."""
    held: NDArray[np.bool_]
    """(T,) where the expression is fully there, or the face at rest."""


def performance(
    shape_names: Sequence[str], rng: np.random.Generator, expressions: int = 10, rate_hz: float = 60.0
) -> Performance:
    """`expressions` in turn, each from neutral and back, 1.5 s apiece.

    Strengths, sides and shapes stray at random, each has a tinge of another expression, some are spoken through; blinks
    come every few seconds.
    """
    times = np.arange(round(1.5 * expressions * rate_hz)) / rate_hz
    weights = np.zeros((len(times), len(shape_names)))
    labels: list[Expression] = ["neutral"] * len(times)
    held = np.zeros(len(times), bool)
    names = [*PROTOTYPES]
    for i in range(expressions):
        expression, tinge = names[i % len(names)], names[rng.integers(len(names))]
        course = bump(times, 1.5 * i + 0.15, 0.3, 0.6, 0.3)
        _show(weights, shape_names, rng, expression, course * rng.uniform(0.3, 1.0))
        _show(weights, shape_names, rng, tinge, course * rng.uniform(0.0, 0.2))
        inside = (times >= 1.5 * i + 0.5) & (times < 1.5 * i + 1.0)
        held |= inside
        for t in np.flatnonzero(inside):
            labels[t] = expression
        if rng.random() < 0.4:
            _speak(weights, times, shape_names, rng, 1.5 * i)
    _blink(weights, times, shape_names, rng)
    return Performance(times, weights.clip(0.0, 1.0), tuple(labels), held)


def babble(
    shape_names: Sequence[str], allowed: Sequence[str], rng: np.random.Generator, seconds: float, rate_hz: float = 60.0
) -> tuple[Array, Array]:
    """Times (T,) and weights (T, B): all `allowed` shapes come and go at random, one in five at a time."""
    times = np.arange(round(seconds * rate_hz)) / rate_hz
    weights = np.zeros((len(times), len(shape_names)))
    for name in allowed:
        weights[:, shape_names.index(name)] = np.clip(smooth_noise(times, rng, (0.2, 1.5), 0.5) - 0.45, 0, 1)
    return times, weights


def moves(shapes: SiteShapes, weights: Array, rng: np.random.Generator, noise_m: float = 0.0) -> Array:
    """(T, S, 3) [m]: what markers at the sites do, every coordinate off by `noise_m`."""
    true: Array = np.einsum("tb,scb->tsc", weights, shapes.displacements)
    return true + rng.normal(scale=noise_m, size=true.shape) if noise_m else true


def _show(
    weights: Array, shape_names: Sequence[str], rng: np.random.Generator, expression: Expression, course: Array
) -> None:
    for shape, strength in PROTOTYPES[expression].items():
        for side in ("", "Left", "Right"):
            if shape + side in shape_names:
                weights[:, shape_names.index(shape + side)] += course * strength * rng.uniform(0.6, 1.1)


def _speak(weights: Array, times: Array, shape_names: Sequence[str], rng: np.random.Generator, start: float) -> None:
    jaw, rounding, closure = syllables(times, rng, start, start + 1.3)
    for name, course in (
        ("jawOpen", 0.35 * jaw),
        ("mouthFunnel", 0.4 * np.maximum(rounding, 0)),
        ("mouthStretchLeft", 0.2 * np.maximum(-rounding, 0)),
        ("mouthStretchRight", 0.2 * np.maximum(-rounding, 0)),
        ("mouthRollLower", 0.5 * closure),
    ):
        if name in shape_names:
            weights[:, shape_names.index(name)] += course


def _blink(weights: Array, times: Array, shape_names: Sequence[str], rng: np.random.Generator) -> None:
    at = rng.uniform(0.5, 2.0)
    while at < times[-1]:
        for name in ("eyeBlinkLeft", "eyeBlinkRight"):
            if name in shape_names:
                weights[:, shape_names.index(name)] += bump(times, at, 0.07, 0.03, 0.12)
        at += rng.uniform(1.0, 4.0)
