"""The hinge of the jaw, fitted to the path of the chin: axis, pivot, and whether the take shows them at all.

Every marker at the chin turns about one line: p(t) = c + R(n, theta(t)) (p0 - c). For an axis n and a point c the turn
theta of a frame has a closed form (`retarget.rig.jaw.signed_angle`), so what is sought is two angles of the axis, two
coordinates of the point, and how far the neutral p0 is off: the arc is short, and a tenth of a millimetre there moves
its centre by millimetres. Gauss and Newton's steps with Cauchy's weights: a jaw that slides sideways or forward for a
while leaves the arc and hardly counts. The rig's hinge, at the performer's size, is the start and a weak prior.
Metres, ``head``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget import geometry
from retarget.errors import RetargetError
from retarget.rig.jaw import signed_angle

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

LEAST_OPENING_RAD = np.radians(6.0)
"""A smaller opening bends its path too little to show the hinge."""
LEAST_FRAMES = 20
LEAST_MEMBERS = 8
MOST_FRAMES = 2000
GROUPS = 8
"""The fit uses so many frames at most, as many of each of so many turns."""
OPEN_RAD = np.radians(1.5)
OPEN_SHARE = 0.3
"""Less open than this part of the widest, the chin tells of muscles rather than of the hinge."""
STRAY = 1.25
"""Turns beyond the widest that lasts are misread markers."""
SIDEWAYS = 0.35
"""Part of the way that a chin which opens may go sideways."""
LOSS_M = 0.0007
"""A marker this far off its arc counts half [m]."""
SHARED_ABSORBED = 2.0
"""A wrong hinge hides part of what the skin does; so much more there is than is left."""
STEPS = 25
WIDE = 4
"""The loss starts 2 to this power times as wide, so that a hinge far from the rig's is found too."""
DONE = 1e-4
PRIOR_PIVOT_M = 0.012
PRIOR_AXIS_RAD = np.radians(4.0)
FINEST_M = 0.00005
"""No skin follows a bone more closely [m]."""
PRIOR_REST_M = 0.0001
"""How well the chin's neutral is known [m], and no better than a fifth of it where the take itself comes back to it."""
CLOSED_S = 1.0
REST_STEPS = 3
CLOSED_M = 0.0015
"""A chin that is this near its neutral is closed [m]."""
UNCERTAIN_M = 0.012
"""A hinge known no better than this is not known [m]."""
INDEPENDENT_HZ = 10.0
"""What skin does beside the bone lasts for about a tenth of a second, so frames closer than that err alike."""


class HingeNotObservableError(RetargetError):
    """The take does not show where the jaw turns."""


@dataclass(frozen=True, slots=True, eq=False)
class Hinge:
    """A line in ``head``, and how well it is known."""

    axis: Array
    """(3,) unit; a positive turn opens the mouth."""
    pivot: Array
    """(3,) [m], the axis's point nearest the middle of the face."""
    residual_m: float
    """Median distance of the chin from its arc while it opens [m]."""
    axis_sd_rad: float
    pivot_sd_m: float
    """Standard deviations [rad] and [m], across the axis, in the direction that is known worst."""
    path_sd_m: float
    """That of the pivot by the path alone, without the rig's hinge for a prior [m]."""
    opening_rad: float
    """Largest turn that was seen, of those that last."""


def fit_hinge(rest: Array, path: Array, rate_hz: float, axis: Array, pivot: Array) -> Hinge:
    """The hinge out of the chin's markers at `rest` (N, 3) and their `path` (T, N, 3), NaN where not seen.

    `axis` and `pivot` (3,) are the rig's hinge at the performer's size. HingeNotObservableError where the jaw hardly
    turns, and where the path leaves the hinge open by more than `UNCERTAIN_M`.
    """
    rest, rest_sd = _rest_on_path(rest, path, rate_hz)
    chosen, groups = _opening_frames(rest, path, axis, pivot)
    model = _Model(rest, path[chosen], groups, axis, pivot)
    fit = _fit(model, len(chosen) * min(INDEPENDENT_HZ / rate_hz, 1.0), rest_sd)
    axis, pivot = model.line(fit.parameters)
    turns = signed_angle(rest - pivot, path - pivot, axis)
    opening = float(np.nanquantile(turns, 0.995))
    if opening < LEAST_OPENING_RAD:
        raise _hardly_opened(opening)
    if fit.path_sd_m[0] > UNCERTAIN_M:
        raise HingeNotObservableError(
            f"The hinge of the jaw is not observable: the chin's path leaves it open by {1e3 * fit.path_sd_m[0]:.0f} "
            "mm, so open and close a few times, wide and slowly; the rig's hinge is kept."
        )
    off = np.linalg.norm(model.misfit(fit.parameters), axis=2)
    return Hinge(
        axis, pivot, float(np.median(off[off > 0])), fit.axis_sd_rad, fit.pivot_sd_m, fit.path_sd_m[1], opening
    )


def _rest_on_path(rest: Array, path: Array, rate_hz: float) -> tuple[Array, float]:
    """The chin's rest (N, 3) as the path shows it whenever the mouth is closed, and how well it is known [m]."""
    for _ in range(REST_STEPS):
        off = np.linalg.norm(path - rest, axis=2)
        closed = (np.isfinite(off) & (off < CLOSED_M)).all(axis=1)
        seconds = closed.sum() / rate_hz
        if seconds < CLOSED_S:
            return rest, PRIOR_REST_M
        rest = np.median(path[closed], axis=0)  # half-made expressions pull at a mean
    return rest, max(PRIOR_REST_M / np.sqrt(seconds * INDEPENDENT_HZ), PRIOR_REST_M / 5)


def _hardly_opened(opening: float) -> HingeNotObservableError:
    return HingeNotObservableError(
        f"The hinge of the jaw is not observable: the jaw was never exercised, it opened by "
        f"{np.degrees(max(opening, 0.0)):.1f} degrees and {np.degrees(LEAST_OPENING_RAD):.0f} are needed; the rig's "
        "hinge is kept."
    )


def _opening_frames(rest: Array, path: Array, axis: Array, pivot: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Frames in which the chin opens rather than slides, spread evenly over how far, and the group of each."""
    turns = signed_angle(rest - pivot, path - pivot, axis)
    seen = np.isfinite(path.sum(axis=2))
    moved = np.where(seen[..., None], path - rest, 0.0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)[:, None]
    straight = np.abs(moved @ axis) <= SIDEWAYS * np.linalg.norm(moved, axis=1)
    widest = float(np.nanquantile(turns, 0.99)) if np.isfinite(turns).any() else 0.0
    opens = np.flatnonzero(np.nan_to_num(turns) > max(OPEN_RAD, OPEN_SHARE * widest))
    opens = opens[straight[opens]]
    opens = opens[turns[opens] < STRAY * widest]
    if len(opens) < LEAST_FRAMES:
        raise _hardly_opened(widest)
    parts = [_thinned(part) for part in _by_turn(opens, turns[opens])]
    return np.concatenate(parts), np.repeat(np.arange(GROUPS), [len(part) for part in parts])


def _by_turn(frames: NDArray[np.intp], turns: Array) -> list[NDArray[np.intp]]:
    """The frames in groups of about the same turn; a group of a few stray frames is none."""
    group = np.digitize(turns, np.linspace(turns.min(), np.quantile(turns, 0.98), GROUPS + 1)[1:-1])
    groups = [frames[group == g] for g in range(GROUPS)]
    return [members if len(members) >= LEAST_MEMBERS else members[:0] for members in groups]


def _thinned(frames: NDArray[np.intp]) -> NDArray[np.intp]:
    """So many of the frames, evenly spread, that no turn drowns the others."""
    most = MOST_FRAMES // GROUPS
    return frames if len(frames) <= most else frames[np.linspace(0, len(frames) - 1, most).astype(np.intp)]


@dataclass(frozen=True, slots=True, eq=False)
class _Model:
    """The arc as a function of two tilts of the axis [rad], two shifts of the pivot across it [m], and three of every
    marker's rest [m].
    """

    rest: Array
    path: Array
    groups: NDArray[np.intp]
    """(F,) which frames have about the same turn."""
    axis: Array
    pivot: Array

    def line(self, parameters: Array) -> tuple[Array, Array]:
        """Axis and pivot; the pivot is where the axis crosses the plane of the given pivot, across the given axis."""
        across = _across(self.axis)
        axis = self.axis + parameters[:2] @ across
        return axis / np.linalg.norm(axis), self.pivot + parameters[2:4] @ across

    def misfit(self, parameters: Array) -> Array:
        """(F, N, 3) [m], the path less the arc; 0 where a marker is not seen."""
        axis, pivot = self.line(parameters)
        levers = self.rest + parameters[4:].reshape(-1, 3) - pivot
        turns = signed_angle(levers, self.path - pivot, axis)
        R = geometry.matrix_from_quat(geometry.quat_from_axis_angle(axis, np.nan_to_num(turns)))
        return np.nan_to_num(self.path - pivot - levers @ R.swapaxes(1, 2))


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    parameters: Array
    axis_sd_rad: float
    pivot_sd_m: float
    path_sd_m: tuple[float, float]
    """Standard deviations of the pivot by the path alone, in the direction known best and in that known worst."""


def _fit(model: _Model, independent: float, rest_sd: float) -> _Fit:
    """The likeliest parameters, were only `independent` of the frames on their own."""
    rest_prior = np.repeat([0.0, rest_sd**-2], [4, model.rest.size])
    prior = rest_prior.copy()
    prior[:4] = np.repeat([PRIOR_AXIS_RAD**-2, PRIOR_PIVOT_M**-2], 2)
    scales = np.concatenate([np.repeat([0.1, 0.01], 2), np.full(model.rest.size, 1e-4)])
    parameters = np.zeros(len(prior))
    for number in range(STEPS):
        loss_m = LOSS_M * max(1.0, 2.0 ** (WIDE - number))
        information, gradient = _normal_equations(model, parameters, independent, loss_m)
        step = np.linalg.solve(information + np.diag(prior), gradient - prior * parameters)
        parameters = parameters + step * min(1.0, 1.0 / float(np.abs(step / scales).max()) if step.any() else 1.0)
        if loss_m == LOSS_M and np.abs(step / scales).max() < DONE:
            break
    covariance = np.linalg.inv(information + np.diag(prior))
    alone = np.linalg.inv(information + np.diag(rest_prior) + 1e-6 * np.eye(len(prior)))
    return _Fit(
        parameters,
        axis_sd_rad=_spreads(covariance[:2, :2])[1],
        pivot_sd_m=_spreads(covariance[2:4, 2:4])[1],
        path_sd_m=_spreads(alone[2:4, 2:4]),
    )


def _spreads(covariance: ArrayLike) -> tuple[float, float]:
    """Standard deviations along the best and the worst direction of a (2, 2)."""
    best, worst = np.sqrt(np.linalg.eigvalsh(np.asarray(covariance, float)).clip(0.0))
    return float(best), float(worst)


def _normal_equations(model: _Model, parameters: Array, independent: float, loss_m: float) -> tuple[Array, Array]:
    """J^T W J and J^T W r of the path, in units of its own spread."""
    steps = np.concatenate([np.repeat([1e-5, 1e-6], 2), np.full(model.rest.size, 1e-6)])
    misfit = model.misfit(parameters)
    moved = np.diag(steps) + parameters
    J = np.stack([(model.misfit(p) - misfit).ravel() / step for p, step in zip(moved, steps, strict=True)], axis=1)
    weight = np.repeat(_weights(misfit, model.groups, independent, loss_m).ravel(), 3)
    return (J * weight[:, None]).T @ J, -(J * weight[:, None]).T @ misfit.ravel()


def _weights(misfit: Array, groups: NDArray[np.intp], independent: float, loss_m: float) -> Array:
    """(F, N) [1/m^2]: Cauchy's weights over variances, so that a group of frames of one turn counts as its mean does.

    That mean is off by the noise, which many frames even out, and by what the skin does beside the bone at this turn,
    which they do not: the misfit that all frames of a group share.
    """
    off = np.linalg.norm(misfit, axis=2)
    robust = np.where(off > 0, 1.0 / (1.0 + (off / loss_m) ** 2), 0.0)
    members = groups == np.arange(GROUPS)[:, None]  # (G, F)
    total = np.maximum(members @ robust, 1e-9)
    mean = np.einsum("gf,fn,fnx->gnx", members, robust, misfit) / total[..., None]
    shared = SHARED_ABSORBED * float((mean**2).mean(axis=2)[total > 1].mean()) if (total > 1).any() else 0.0
    noise = float((robust * off**2).sum() / max(3 * robust.sum(), 1e-9)) + FINEST_M**2
    variance = noise / np.maximum(total * (independent / len(misfit)), 1.0) + shared  # (G, N), of a group's mean
    weights: Array = robust / (variance * total)[groups]
    return weights


def _across(axis: Array) -> Array:
    """(2, 3): two unit vectors square to the axis and to each other."""
    other = np.eye(3)[np.argmin(np.abs(axis))]
    first = np.cross(axis, other)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first)])
