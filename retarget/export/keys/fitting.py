"""Error-bounded fitting of the cubic Hermite curve that the target program evaluates.

Keys are recorded samples; between two keys, the slopes at both ends are those of the smallest squared error, moved
towards the smallest largest error where that is needed (Lawson 1961). From each key the fit reaches as far as the
tolerance lets it. Many curves advance together, so that a long take costs few array operations; it is cut into
stretches for that, which are joined again where the tolerance allows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from retarget.export.keys.curve import Curve, hermite_basis
from retarget.export.keys.distance import euclidean

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from retarget.export.keys.distance import Distance

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

STRETCH = 1024
"""Samples of one stretch."""
_REWEIGHTINGS = 3
_HOPEFUL = 2.0  # times the tolerance: a least-squares fit worse than that is not brought within it
_BATCH = 2_000_000  # numbers in one working array


class _Fit(NamedTuple):
    """A cubic over each of B spans."""

    out_slopes: Array
    """(B, C) at the start."""
    in_slopes: Array
    """(B, C) at the end."""
    error: Array
    """(B,) largest over the span's samples."""


class _Samples(NamedTuple):
    times_s: Array
    """(N,)."""
    values: Array
    """(L, N, C)."""
    distance: Distance


def fit_curves(times_s: Array, values: Array, tolerance: ArrayLike, distance: Distance = euclidean) -> list[Curve]:
    """One curve for each of L channels, `values` (L, N, C) at `times_s` (N,), N at least 1.

    At every recorded time a curve lies within `tolerance` (a number or (L,)) of the record, in the unit of
    `distance`. Raises ValueError where times do not rise or a value is not finite.
    """
    if not len(times_s) or np.any(np.diff(times_s) <= 0) or not np.isfinite(values).all():
        raise ValueError("A curve is fitted to finite values at times that rise.")
    samples = _Samples(times_s, values, distance)
    bound = np.broadcast_to(np.asarray(tolerance, float), len(values))
    kept = _reach(samples, bound)
    kept = _joined(samples, bound, kept)
    return _curves(samples, bound, kept)


def _reach(samples: _Samples, bound: Array) -> list[Index]:
    """Keys of each channel, a key at each end of a stretch."""
    channels, count = samples.values.shape[:2]
    starts = np.arange(0, max(count - 1, 1), STRETCH)
    lane_channel = np.repeat(np.arange(channels), len(starts))
    at = np.tile(starts, channels)
    stop = np.minimum(at + STRETCH, count - 1)
    found = [(lane_channel, at.copy())]
    step = np.full(len(at), 4)
    live = np.flatnonzero(at < stop)
    while len(live):
        end = _furthest(samples, bound, lane_channel[live], at[live], stop[live], step[live])
        step[live] = end - at[live]
        at[live] = end
        found.append((lane_channel[live], end))
        live = live[end < stop[live]]
    channel = np.concatenate([channel for channel, _ in found])
    key = np.concatenate([key for _, key in found])
    return [np.unique(key[channel == c]) for c in range(channels)]


def _furthest(samples: _Samples, bound: Array, channel: Index, at: Index, stop: Index, step: Index) -> Index:
    """The furthest end (B,) that a cubic from `at` reaches: doubling from the last `step`, then bisection."""
    good = at + 1
    bad = stop + 1
    trial = np.minimum(at + np.maximum(step, 2), stop)
    open_ = np.flatnonzero(bad - good > 1)
    while len(open_):
        fits = _within(samples, bound, channel[open_], at[open_], trial[open_])
        good[open_] = np.where(fits, trial[open_], good[open_])
        bad[open_] = np.where(fits, bad[open_], trial[open_])
        doubled = np.minimum(at + 2 * (good - at), stop)
        trial = np.where(bad > stop, doubled, (good + bad) // 2)
        open_ = open_[bad[open_] - good[open_] > 1]
    return good


def _within(samples: _Samples, bound: Array, channel: Index, start: Index, end: Index) -> NDArray[np.bool_]:
    return _fit(samples, bound[channel], channel, start, end).error <= bound[channel]


def _fit(samples: _Samples, bound: Array, channel: Index, start: Index, end: Index) -> _Fit:
    """Fit spans of like length together, so that short ones are not padded to the longest."""
    components = samples.values.shape[2]
    slopes = np.zeros((2, len(start), components))
    error = np.zeros(len(start))
    order = np.argsort(end - start, kind="stable")
    while len(order):
        longest = int((end - start)[order[-1]])
        shortest = longest // 2
        least = np.searchsorted((end - start)[order], shortest, side="right")
        group = order[max(least, len(order) - max(1, _BATCH // (longest * components))) :]
        order = order[: len(order) - len(group)]
        fit = _fit_padded(samples, bound[group], channel[group], start[group], end[group])
        slopes[0, group], slopes[1, group], error[group] = fit
    return _Fit(slopes[0], slopes[1], error)


def _fit_padded(samples: _Samples, bound: Array, channel: Index, start: Index, end: Index) -> _Fit:
    """Samples strictly inside each span, padded with its end, which weighs nothing."""
    length_s = samples.times_s[end] - samples.times_s[start]
    inner = start[:, None] + np.arange(1, max(2, int((end - start).max())))
    counts = inner < end[:, None]
    inner = np.minimum(inner, end[:, None])
    u = (samples.times_s[inner] - samples.times_s[start][:, None]) / length_s[:, None]
    _, h10, _, h11 = hermite_basis(u)
    recorded = samples.values[channel[:, None], inner]
    chord = samples.values[channel, end] - samples.values[channel, start]
    line = samples.values[channel, start][:, None] + u[..., None] * chord[:, None]
    weights = counts.astype(float)
    best: _Fit | None = None
    hopeful = np.ones(len(start), bool)
    for _ in range(1 + _REWEIGHTINGS):
        m = _slopes(h10, h11, recorded - line, weights)
        fitted = line + h10[..., None] * m[:, 0, None] + h11[..., None] * m[:, 1, None]
        errors = samples.distance(fitted, recorded) * counts
        m = (m + chord[:, None]) / length_s[:, None, None]
        fit = _Fit(m[:, 0], m[:, 1], errors.max(axis=1))
        best = fit if best is None else _better(best, fit, hopeful)
        hopeful &= (best.error > bound) & (best.error < _HOPEFUL * bound)
        if not hopeful.any():
            break
        weights = weights * (errors + 1e-3 * fit.error[:, None])
        weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-300)
    return fit if best is None else best


def _better(a: _Fit, b: _Fit, wanted: NDArray[np.bool_]) -> _Fit:
    """`b` where it is `wanted` and nearer."""
    first = (a.error <= b.error) | ~wanted
    pick = first[:, None]
    return _Fit(
        np.where(pick, a.out_slopes, b.out_slopes),
        np.where(pick, a.in_slopes, b.in_slopes),
        np.where(first, a.error, b.error),
    )


def _slopes(h10: Array, h11: Array, rest: Array, weights: Array) -> Array:
    """Both slopes (B, 2, C), per unit of u and over the straight line's, of the least squares of `rest` (B, S, C)."""
    basis = np.stack([h10, h11], axis=1)
    weighted = basis * weights[:, None]
    normal = weighted @ basis.transpose(0, 2, 1)
    target = weighted @ rest
    trace = np.trace(normal, axis1=1, axis2=2)
    # one sample inside a span leaves a direction free: nearest to the straight line then
    normal += (1e-9 * trace + 1e-300)[:, None, None] * np.eye(2)
    determinant = normal[:, 0, 0] * normal[:, 1, 1] - normal[:, 0, 1] ** 2
    adjugate = np.stack([normal[:, 1, 1], -normal[:, 0, 1], -normal[:, 0, 1], normal[:, 0, 0]], axis=1)
    inverse = adjugate.reshape(-1, 2, 2) / np.where(determinant > 0, determinant, np.inf)[:, None, None]
    solved: Array = inverse @ target
    return solved


def _joined(samples: _Samples, bound: Array, kept: list[Index]) -> list[Index]:
    """Without the ends of stretches where one cubic serves both sides."""
    count = samples.values.shape[1]
    for border in range(STRETCH, count - 1, STRETCH):
        places = np.array([np.searchsorted(keys, border) for keys in kept])
        before = np.array([keys[p - 1] for keys, p in zip(kept, places, strict=True)])
        after = np.array([keys[p + 1] for keys, p in zip(kept, places, strict=True)])
        fits = _within(samples, bound, np.arange(len(kept)), before, after)
        kept = [np.delete(k, p) if ok else k for k, p, ok in zip(kept, places, fits, strict=True)]
    return kept


def _curves(samples: _Samples, bound: Array, kept: list[Index]) -> list[Curve]:
    spans = np.array([len(keys) - 1 for keys in kept])
    channel = np.repeat(np.arange(len(kept)), spans)
    start = np.concatenate([keys[:-1] for keys in kept])
    end = np.concatenate([keys[1:] for keys in kept])
    fit = _fit(samples, bound[channel], channel, start, end)
    stops = np.cumsum(spans)
    curves = []
    for lane, keys in enumerate(kept):
        own = slice(stops[lane] - spans[lane], stops[lane])
        still = np.zeros((1, samples.values.shape[2]))
        arriving = np.concatenate([still, fit.in_slopes[own]])
        leaving = np.concatenate([fit.out_slopes[own], still])
        curves.append(Curve(samples.times_s[keys], samples.values[lane, keys], arriving, leaving))
    return curves
