"""Where the facial joints stand: one vertex of the base mesh for each site, and the right side by its mirror image.

The places are those of a mocap supervisor's markers; they hold for every identity, because the base mesh keeps its
topology.
"""

from __future__ import annotations

LEFT = {
    "foreheadLeft": 7437,
    "browInnerLeft": 6983,
    "browMidLeft": 6996,
    "browOuterLeft": 6999,
    "noseWingLeft": 11672,
    "lidUpperLeft": 6874,
    "lidLowerLeft": 11479,
    "eyeInnerLeft": 6896,
    "eyeOuterLeft": 6812,
    "cheekUpperLeft": 11910,
    "cheekLowerLeft": 11893,
    "cheekOuterLeft": 11794,
    "lipUpperLeft": 11948,
    "lipCornerLeft": 10405,
    "lipLowerLeft": 7239,
    "chinLeft": 7454,
    "mandibleLeft": 11905,
}
MIDDLE = {
    "forehead": 5192,
    "browCenter": 227,
    "noseBridge": 134,
    "noseTip": 5054,
    "lipUpper": 5342,
    "lipLower": 496,
    "chin": 733,
}
JAW_RIDERS = ("lipLower", "chin", "mandible")
"""Beginnings of the names of the sites whose joints are children of the jaw."""


def other_side(site: str) -> str:
    """The site on the right for one on the left."""
    return site.replace("Left", "Right")


def rides_jaw(site: str) -> bool:
    """True where the joint of `site` is a child of the jaw."""
    return site.startswith(JAW_RIDERS)
