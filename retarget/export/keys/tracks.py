"""Reduction of whole performances: joints and blend shapes, each kind with its own tolerance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.export.keys.curve import Curve
from retarget.export.keys.distance import angle_deg, euclidean
from retarget.export.keys.fitting import fit_curves
from retarget.export.keys.report import KeyReport, report_keys

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.export.keys.distance import Distance

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Tolerances:
    """How far a curve may lie from what was recorded, at any recorded time."""

    translation_mm: float = 0.1
    rotation_deg: float = 0.1
    weight: float = 0.005


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """Curves of a performance, and what their reduction did."""

    translations: list[Curve]
    """(J,) of 3 components [m], relative to the parent."""
    rotations: list[Curve]
    """(J,) of 4 components xyzw, relative to the parent, without flips of sign; to be normalised when evaluated."""
    weights: list[Curve]
    """(B,) of 1 component in [0, 1]."""
    reports: tuple[KeyReport, ...]
    """Translations, rotations, weights."""


def fit_tracks(
    times_s: Array, translations: Array, rotations: Array, weights: Array, tolerances: Tolerances | None = None
) -> Tracks:
    """Reduce `translations` (N, J, 3) [m], unit `rotations` (N, J, 4) xyzw and `weights` (N, B) at `times_s` (N,).

    Errors as of `fit_curves`, which says what the curves keep to.
    """
    bounds = tolerances or Tolerances()
    moved, moved_report = _reduced("translations", "mm", times_s, 1e3 * translations, bounds.translation_mm, euclidean)
    turned, turned_report = _reduced(
        "rotations", "degrees", times_s, without_flips(rotations), bounds.rotation_deg, angle_deg
    )
    weighed, weighed_report = _reduced("weights", "of 1", times_s, weights[..., None], bounds.weight, euclidean)
    metres = [_scaled(curve, 1e-3) for curve in moved]
    return Tracks(metres, turned, weighed, (moved_report, turned_report, weighed_report))


def without_flips(rotations: Array) -> Array:
    """The same turns (N, ..., 4), each quaternion on the side of the one before it."""
    agreement = np.einsum("n...c,n...c->n...", rotations[1:], rotations[:-1])
    signs = np.cumprod(np.where(agreement < 0, -1.0, 1.0), axis=0)
    return np.concatenate([rotations[:1], rotations[1:] * signs[..., None]])


def _reduced(
    what: str, unit: str, times_s: Array, values: Array, tolerance: float, distance: Distance
) -> tuple[list[Curve], KeyReport]:
    channels = np.ascontiguousarray(np.swapaxes(values, 0, 1))
    curves = fit_curves(times_s, channels, tolerance, distance) if len(channels) else []
    return curves, report_keys(what, unit, [(times_s, channel) for channel in channels], curves, distance)


def _scaled(curve: Curve, factor: float) -> Curve:
    return Curve(curve.times_s, factor * curve.values, factor * curve.in_slopes, factor * curve.out_slopes)
