"""Markers from files and streams: read, labelled, the still face found, carried into the head's frame, gaps filled."""

from retarget.markers.c3d import read_c3d
from retarget.markers.clip import MarkerClip
from retarget.markers.fill import Filler
from retarget.markers.label import Labeller
from retarget.markers.layouts import Layout, available_layouts, detect_layout, load_layout
from retarget.markers.neutral import Neutral, StillMoment
from retarget.markers.stabilise import Stabiliser

__all__ = [
    "Filler",
    "Labeller",
    "Layout",
    "MarkerClip",
    "Neutral",
    "Stabiliser",
    "StillMoment",
    "available_layouts",
    "detect_layout",
    "load_layout",
    "read_c3d",
]
