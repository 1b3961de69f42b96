"""The jaw in two plots: the chin's path and arc from the side, and its slides from below. Millimetres, ``head``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calib.svg import FAINT, INK, Plot
from retarget import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from calib.calibration import Calibration

    Array = NDArray[np.float64]

OPEN, CLOSED, ARC = "#c2410c", "#2f7fc2", "#111827"
DOTS = 900
OPENED = 0.3
"""Part of the widest opening from which on a frame counts as open."""


def side_view(calibration: Calibration) -> str:
    """The face from its left, looking to the right; "" where there is no jaw."""
    jaw, fitted = calibration.performer.jaw, calibration.jaw
    if jaw is None or fitted is None:
        return ""
    path, turns = _chin(calibration)
    rest = calibration.performer.neutral
    seen = 1e3 * rest[np.isfinite(rest).all(axis=1)]
    pivot = 1e3 * jaw.pivot
    every = np.vstack([seen, path, pivot[None]])[:, [2, 1]]
    plot = _plot(every)
    plot.points(seen[:, [2, 1]], FAINT, 2.0, 0.8)
    opened = turns > OPENED * max(fitted.opening_rad, 1e-3)
    plot.points(path[~opened][:, [2, 1]], CLOSED, 1.3, 0.35)
    plot.points(path[opened][:, [2, 1]], OPEN, 1.6, 0.5)
    plot.line(_arc(calibration)[:, [2, 1]], ARC, 1.5, "5 3")
    plot.cross(pivot[[2, 1]], ARC)
    plot.text(pivot[[2, 1]], "hinge" if fitted.hinge else "hinge (the rig's)")
    _name_sites(plot, calibration)
    return plot.svg("The path of the chin from the side, with the hinge and the arc fitted to it")


def view_from_below(calibration: Calibration) -> str:
    """Slides while the mouth is nearly closed: to the performer's left is right, forward is up; "" without a jaw."""
    jaw = calibration.jaw
    if jaw is None:
        return ""
    closed = np.abs(jaw.motion.turn_rad) < OPENED * max(jaw.opening_rad, 1e-3)
    closed &= np.isfinite(jaw.motion.forward_m) & np.isfinite(jaw.motion.left_m)
    at = 1e3 * np.stack([jaw.motion.left_m, jaw.motion.forward_m], axis=1)[closed]
    slides = 1e3 * np.array([-jaw.slides.right_m, jaw.slides.left_m, jaw.slides.forward_m])
    plot = _plot(np.vstack([at, [[slides[0] - 2, -3], [slides[1] + 2, slides[2] + 2]]]))
    plot.points(at[:: max(len(at) // DOTS, 1)], CLOSED, 1.5, 0.4)
    for words, place in (
        (f"left {slides[1]:.1f}", (slides[1], 0.0)),
        (f"right {-slides[0]:.1f}", (slides[0], 0.0)),
        (f"forward {slides[2]:.1f}", (0.0, slides[2])),
    ):
        plot.cross(place, INK, 4)
        plot.text(place, words)
    return plot.svg("How far the jaw slid to the sides and forward with the mouth nearly closed")


def _chin(calibration: Calibration) -> tuple[Array, Array]:
    """(N, 3) [mm] the middle of the chin's markers in frames that show them all, and the jaw's turn [rad]."""
    chin = calibration.face.markers[calibration.face.chin]
    path = 1e3 * calibration.laid.positions[:, chin].mean(axis=1)
    turns = calibration.jaw.motion.turn_rad if calibration.jaw else np.zeros(len(path))
    shown = np.flatnonzero(np.isfinite(path).all(axis=1) & np.isfinite(turns))
    shown = shown[:: max(len(shown) // DOTS, 1)]
    return path[shown], turns[shown]


def _arc(calibration: Calibration) -> Array:
    """(N, 3) [mm] where the hinge carries the middle of the chin, from the neutral to the widest opening."""
    jaw, fitted = calibration.performer.jaw, calibration.jaw
    if jaw is None or fitted is None:
        return np.zeros((0, 3))
    rest = calibration.performer.neutral[calibration.face.markers[calibration.face.chin]].mean(axis=0)
    angles = np.linspace(0.0, max(fitted.opening_rad, np.radians(5.0)), 40)
    R = geometry.matrix_from_quat(geometry.quat_from_axis_angle(jaw.axis, angles))
    arc: Array = 1e3 * ((rest - jaw.pivot) @ R.swapaxes(1, 2) + jaw.pivot)
    return arc


def _plot(points: Array) -> Plot:
    points = points[np.isfinite(points).all(axis=1)]
    (left, bottom), (right, top) = points.min(axis=0) - 4, points.max(axis=0) + 4
    return Plot((float(left), float(right)), (float(bottom), float(top)))


def _name_sites(plot: Plot, calibration: Calibration) -> None:
    for site in ("forehead", "noseTip", "noseBridge", "chin"):
        if site in calibration.face.names:
            at = calibration.performer.neutral[calibration.face.markers[calibration.face.names.index(site)]]
            plot.text(1e3 * at[[2, 1]], site, FAINT)
