"""The expressions of a range-of-motion take: what the performer is asked for, and which of the rig's shapes show it.

Shapes carry ARKit's names; of a rig's shapes those that it has are taken. The guide asks for them in this order.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Expression:
    """One thing that a face does."""

    name: str
    shapes: tuple[str, ...]
    """Of the rig, all at their full weight."""
    ask: str
    """What the performer is told."""
    sides: bool
    """True where the left and the right can do it apart."""
    never: str
    """What the report says where it was not seen; {side} is "left ", "right " or "left and right "."""


EXPRESSIONS = (
    Expression("jawOpen", ("jawOpen",), "open your mouth wide, and close it", False, "the jaw never opened"),
    Expression("jawLeft", ("jawLeft",), "slide your jaw to your left", False, "the jaw never went to the left"),
    Expression("jawRight", ("jawRight",), "slide your jaw to your right", False, "the jaw never went to the right"),
    Expression("jawForward", ("jawForward",), "push your jaw forward", False, "the jaw never came forward"),
    Expression(
        "smile",
        ("mouthSmileLeft", "mouthSmileRight"),
        "smile as broadly as you can",
        True,
        "the {side}corner of the mouth never smiled",
    ),
    Expression("pucker", ("mouthPucker",), "pucker your lips, as for a kiss", False, "the lips never puckered"),
    Expression(
        "browsUp",
        ("browInnerUp", "browOuterUpLeft", "browOuterUpRight"),
        "raise your brows",
        True,
        "the {side}brow never rose",
    ),
    Expression(
        "browsDown", ("browDownLeft", "browDownRight"), "frown: brows down", True, "the {side}brow never came down"
    ),
    Expression("cheeks", ("cheekPuff",), "puff up your cheeks", True, "the {side}cheek never puffed"),
    Expression(
        "nose", ("noseSneerLeft", "noseSneerRight"), "wrinkle your nose", True, "the {side}nose wing never wrinkled"
    ),
)
BY_NAME = {expression.name: expression for expression in EXPRESSIONS}
REGIONS = {
    "brows": ("forehead", "brow"),
    "eyes": ("lid", "eye"),
    "nose": ("nose",),
    "cheeks": ("cheek",),
    "mouth": ("lip",),
    "jaw": ("chin", "mandible"),
}
"""Beginnings of the names of the sites of a region; within one, neighbours act alike."""


def region_of(site: str) -> str:
    """The region of a site; one of its own for a site of another name."""
    return next((region for region, starts in REGIONS.items() if site.startswith(starts)), site)


def side_of(site: str) -> str:
    """Left or Right, as a name ends; an empty text for a site in the middle."""
    return next((side for side in ("Left", "Right") if site.endswith(side)), "")


def mirror_of(site: str) -> str:
    """The same place on the other side; the site itself in the middle."""
    side = side_of(site)
    return site.removesuffix(side) + {"Left": "Right", "Right": "Left", "": ""}[side]
