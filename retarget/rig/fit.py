"""A performer out of nothing but a still face: its size beside the rig's, where its head is, and default gains.

A similarity p_rig = s R p_world + t takes the neutral markers to the rig's sites (Umeyama 1991). Faces differ, and a
marker may carry a wrong name, so the fit is repeated with Geman and McClure's weights: a marker far off what the others
agree on hardly counts. s is the size ratio; R and t / s, in the performer's own metres, are the head.
"""

from __future__ import annotations

import datetime
from typing import TYPE_CHECKING

import numpy as np

from retarget import geometry
from retarget.errors import InputError
from retarget.performer import Performer, PerformerJaw, gain_matrix

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerLayout
    from retarget.rig.model import Rig

    Array = NDArray[np.float64]

FEWEST_SITES = 4
ITERATIONS = 20
THINNEST = 0.05
"""Second extent of the sites over the first: below it they lie on one line."""
MIRRORED = 0.5
"""A mirror image that fits this much better than the face itself is no accident."""
PLAUSIBLE_SCALES = (0.02, 50.0)


def performer_from_neutral(
    layout: MarkerLayout,
    neutral_world: Array,
    rig: Rig,
    *,
    name: str = "performer",
    date: datetime.date | None = None,
    noise: Array | None = None,
) -> tuple[Performer, Array]:
    """A performer for `rig` and T_world_head (4, 4) at the neutral, from the still face `neutral_world` (M, 3) [m].

    NaN rows are markers that were not seen; `noise` (M,) [m] is their deviation at rest; `date` is today by default.
    Every K is the size ratio, the hinge is the rig's. InputError where fewer than four seen markers, off one line, have
    a site on the rig, where they fit it only as its mirror image, and where their size is no face's in metres.
    """
    neutral_world = np.asarray(neutral_world, float)
    markers = _shared_markers(layout, neutral_world, rig)
    sites = [layout.sites[i] for i in markers]
    p_rig = np.array([rig.sites[site].rest for site in sites])
    T_rig_world, scale = _robust_similarity(neutral_world[markers], p_rig)
    _check(layout, neutral_world[markers], p_rig, scale)
    T_head_world = geometry.transform(T_rig_world[:3, :3], T_rig_world[:3, 3] / scale)
    performer = Performer(
        name=name,
        rig=rig.name,
        layout=layout.name,
        date=date or datetime.datetime.now(datetime.UTC).astimezone().date(),
        markers=layout.names,
        head_markers=tuple(layout.names[i] for i in layout.head),
        neutral=geometry.apply(T_head_world, neutral_world),
        noise=np.full(len(layout.names), np.nan) if noise is None else np.asarray(noise, float),
        scale=scale,
        K={site: gain_matrix(scale) for site in sites},
        jaw=_default_jaw(rig, scale),
    )
    return performer, geometry.inverse(T_head_world)


def _shared_markers(layout: MarkerLayout, neutral: Array, rig: Rig) -> list[int]:
    """Indices of the markers that were seen and have a site on the rig."""
    if not rig.sites:
        raise InputError(f"The rig {rig.name!r} has no sites for markers to drive; add them to [sites] in {rig.path}.")
    seen = np.isfinite(neutral.sum(axis=1)).tolist()
    shared = [i for i, site in enumerate(layout.sites) if site in rig.sites and seen[i]]
    places = {layout.sites[i]: rig.sites[layout.sites[i]].rest for i in shared}
    if (
        len(places) < FEWEST_SITES
        or min(_thinness(neutral[shared]), _thinness(np.array([*places.values()]))) < THINNEST
    ):
        names = ", ".join(name for name, was_seen in zip(layout.names, seen, strict=True) if was_seen)
        raise InputError(
            f"The neutral needs markers at {FEWEST_SITES} or more sites of the rig, not on one line, and has them at "
            f"{len(places)}: the markers seen are {names or 'none'}; the sites of the rig {rig.name!r} are "
            f"{', '.join(rig.sites)}."
        )
    return shared


def _thinness(points: Array) -> float:
    """0 for points (N, 3) on one line or in one place, 1 for a disc or a ball."""
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(extents[1] / extents[0]) if extents[0] > 0 else 0.0


def _robust_similarity(p_world: Array, p_rig: Array) -> tuple[Array, float]:
    """T_rig_world and scale, by weights (sigma^2 / (sigma^2 + r^2))^2 on the residuals r, sigma from their median."""
    weights = np.ones(len(p_rig))
    for _ in range(ITERATIONS):
        T, scale = geometry.umeyama(p_world, p_rig, weights)
        residuals = _residuals(p_world, p_rig, T, scale)
        sigma = 1.5 * np.median(residuals) + 1e-9  # about one standard deviation of a residual in space
        weights = (sigma**2 / (sigma**2 + residuals**2)) ** 2
    return T, scale


def _residuals(p_world: Array, p_rig: Array, T_rig_world: Array, scale: float) -> Array:
    residuals: Array = np.linalg.norm(geometry.apply(T_rig_world, scale * p_world) - p_rig, axis=1)
    return residuals


def _check(layout: MarkerLayout, p_world: Array, p_rig: Array, scale: float) -> None:
    if not PLAUSIBLE_SCALES[0] < scale < PLAUSIBLE_SCALES[1]:
        raise InputError(
            f"The rig's face is {scale:.3g} times as large as the markers of the layout {layout.name!r}: "
            "positions must be in metres, so check the unit of the file or the stream."
        )
    as_they_are, mirrored = (
        float(np.median(_residuals(p_world, target, *_robust_similarity(p_world, target))))
        for target in (p_rig, p_rig * [-1.0, 1.0, 1.0])
    )
    size = float(np.linalg.norm(p_rig - p_rig.mean(axis=0), axis=1).mean())
    if as_they_are > 0.1 * size and mirrored < MIRRORED * as_they_are:
        raise InputError(
            f"The markers of the layout {layout.name!r} fit the rig only as its mirror image: left and right are the "
            "performer's own, so check the names, and that the axes are right-handed."
        )


def _default_jaw(rig: Rig, scale: float) -> PerformerJaw | None:
    if rig.jaw is None:
        return None
    return PerformerJaw(
        axis=rig.jaw.axis, pivot=rig.jaw.pivot / scale, gain=1.0, min_rad=rig.jaw.min_rad, max_rad=rig.jaw.max_rad
    )
