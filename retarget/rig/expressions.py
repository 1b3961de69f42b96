"""Which expression a face shows, by a rule on the weights of its blend shapes: neutral, joy, anger, sorrow, surprise.

Every expression is a list of shapes that make it, as P. Ekman and W. Friesen's Facial Action Coding System has them
(Facial Action Coding System, 1978, and its EMFACS prototypes):

- joy: the corners of the mouth go up and the cheeks with them (action units 12 and 6);
- anger: brows down, lids tight, nose wrinkled, lips pressed (4, 7, 9, 23 and 24);
- sorrow: the inner brows up, the corners of the mouth down, the chin's boss raised (1, 15, 17);
- surprise: all of the brows up, eyes wide, the jaw drops (1 and 2, 5, 26).

Its score is the mean of its shapes, sides averaged, weighted by how much each tells, less what speaks against it:
shapes that the expression lacks and another has. The highest score wins if it is above `NEUTRAL_BELOW`, else the face
is neutral. Shapes that the rig lacks, or that its markers cannot tell, are left out of the mean.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Expression = Literal["neutral", "joy", "anger", "sorrow", "surprise"]

NEUTRAL_BELOW = 0.12
FOR: dict[Expression, dict[str, float]] = {
    "joy": {"mouthSmile": 3.0, "cheekSquint": 1.0},
    "anger": {"browDown": 3.0, "noseSneer": 1.5, "mouthPress": 1.0, "eyeSquint": 0.5},
    "sorrow": {"mouthFrown": 3.0, "browInnerUp": 1.5, "mouthShrugLower": 0.5},
    "surprise": {"browOuterUp": 3.0, "browInnerUp": 1.0, "eyeWide": 1.0, "jawOpen": 0.5},
}
"""How much each shape tells; a name without a side stands for both."""
AGAINST: dict[Expression, dict[str, float]] = {
    "joy": {"mouthFrown": 1.0, "browDown": 0.5},
    "anger": {"browOuterUp": 1.0, "mouthSmile": 1.0},
    "sorrow": {"mouthSmile": 1.0, "browOuterUp": 1.0, "browDown": 0.5},
    "surprise": {"browDown": 1.0, "mouthFrown": 0.5},
}
"""Taken off the score for a shape at weight 1."""


class Verdict(NamedTuple):
    """What a face shows."""

    expression: Expression
    scores: dict[Expression, float]
    """Of all but neutral; about 1 for an expression shown with all its shapes, below 0 where others speak against."""


class ExpressionRule:
    """The rule for the shapes of one rig."""

    def __init__(self, shape_names: Sequence[str], observed: Collection[str] | None = None) -> None:
        """`shape_names` (B,) in the order of the weights, of which only the `observed` are asked; all by default.

        InputError where they tell none of the expressions.
        """
        asked = [name if observed is None or name in observed else "" for name in shape_names]
        self.known: tuple[Expression, ...] = tuple(e for e, shapes in FOR.items() if _columns(asked, shapes).any())
        """The expressions that these shapes can tell."""
        if not self.known:
            raise InputError(
                "None of the blend shapes tells an expression: they need names such as "
                f"{', '.join(name for shapes in FOR.values() for name in [*shapes][:1])} with Left and Right."
            )
        self._pro = np.array([_mean_row(_columns(asked, FOR[e])) for e in self.known])  # (E, B)
        self._con = np.array([_columns(asked, AGAINST[e]) for e in self.known])

    def __call__(self, weights: Array) -> Verdict:
        """The expression of `weights` (B,)."""
        values = (self._pro - self._con) @ weights
        scores = dict(zip(self.known, values.tolist(), strict=True))
        best = max(self.known, key=scores.__getitem__)
        return Verdict(best if scores[best] > NEUTRAL_BELOW else "neutral", scores)


def _columns(names: Sequence[str], shapes: dict[str, float]) -> Array:
    """(B,): what each named shape counts for, half where it is one of two sides; 0 for those not in `shapes`."""
    counts = np.zeros(len(names))
    for shape, count in shapes.items():
        members = [
            i for i, name in enumerate(names) if name and name.removesuffix("Left").removesuffix("Right") == shape
        ]
        for i in members:
            counts[i] = count / len(members)
    return counts


def _mean_row(counts: Array) -> Array:
    total = counts.sum()
    return counts / total if total else counts
