"""Weights out of markers: how near they come to the truth, and how long it takes, beside scipy's solvers.

Truth is a performance of expressions, speech and blinks (`tests.synthetic.weights`) through the shipped rig's own
shapes, with 0.3 mm of noise on every coordinate; and "babble", all shapes that the markers can tell at random, which no
face does. The error is that of the shapes that are driven. scipy's solvers get the same equations, each frame by
itself; `nnls` knows no upper bound and is cut off at 1.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from retarget.rig.box_least_squares import BoxLeastSquares, kkt_violation
from retarget.rig.load import load_rig
from retarget.rig.shapes import NOISE_M, SMOOTHNESS, SPARSITY, ShapeSolver
from retarget.rig.site_shapes import site_shapes
from tests.benchmarks.report import Row
from tests.synthetic.face import ALL_SITES, FACE24_SITES
from tests.synthetic.weights import babble, moves, performance

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from retarget.rig.site_shapes import SiteShapes

    Array = NDArray[np.float64]

LAYOUTS = {"24 markers (20 at sites)": FACE24_SITES, "41 markers": ALL_SITES}
RATES_HZ = (60.0, 120.0)
SEEDS = 3
PEER_FRAMES = 120


def rows() -> Iterator[Row]:
    """For both layouts: error, time, conditions of the minimum."""
    rig = load_rig("human")
    for layout, sites in LAYOUTS.items():
        shapes = site_shapes(rig, sites)
        solver = ShapeSolver(shapes)
        told = f"{layout}, {len(solver.driven)} of {len(rig.shape_names)} shapes driven"
        for rate_hz in RATES_HZ:
            takes = [_performed(shapes, seed, rate_hz) for seed in range(SEEDS)]
            yield Row(f"{told}, performance at {rate_hz:.0f} Hz, RMSE", _rmse(solver, takes), "", aim="0.02")
        takes = [_babbled(shapes, solver, seed) for seed in range(SEEDS)]
        yield Row(f"{told}, babble at 60 Hz, RMSE", _rmse(solver, takes), "")
        yield from _beside_scipy(layout, shapes, solver)


class _Take(NamedTuple):
    times: Array
    weights: Array
    moves: Array


def _performed(shapes: SiteShapes, seed: int, rate_hz: float) -> _Take:
    rng = np.random.default_rng(seed)
    played = performance(shapes.shape_names, rng, rate_hz=rate_hz)
    return _Take(played.times, played.weights, moves(shapes, played.weights, rng, NOISE_M))


def _babbled(shapes: SiteShapes, solver: ShapeSolver, seed: int) -> _Take:
    rng = np.random.default_rng(seed)
    times, weights = babble(shapes.shape_names, solver.driven, rng, 10.0)
    return _Take(times, weights, moves(shapes, weights, rng, NOISE_M))


def _rmse(solver: ShapeSolver, takes: list[_Take]) -> float:
    errors = []
    for take in takes:
        solver.reset()
        found = np.array([solver(m, t) for m, t in zip(take.moves, take.times.tolist(), strict=True)])
        errors.append(found - take.weights)
    driven = np.flatnonzero(found.any(axis=0))
    return float(np.sqrt(np.mean(np.concatenate(errors)[:, driven] ** 2)))


def _beside_scipy(layout: str, shapes: SiteShapes, solver: ShapeSolver) -> Iterator[Row]:
    """All 52 shapes, nothing but the equations: the same problem for everyone; then our own way, in sequence."""
    from scipy.optimize import lsq_linear, nnls

    take = _performed(shapes, 0, 60.0)
    A = shapes.displacements.reshape(-1, len(shapes.shape_names)) / NOISE_M
    frames = take.moves.reshape(len(take.moves), -1)[:PEER_FRAMES] / NOISE_M
    true = take.weights[:PEER_FRAMES]
    plain = BoxLeastSquares(A)
    ours, ours_s = _timed(plain, frames)
    box, box_s = _timed(lambda b: lsq_linear(A, b, (0, 1)).x, frames)
    bvls, bvls_s = _timed(lambda b: lsq_linear(A, b, (0, 1), method="bvls").x, frames)
    positive, positive_s = _timed(lambda b: nnls(A, b)[0].clip(0, 1), frames)
    what = f"{layout} x {A.shape[1]} shapes, plain least squares in the box"
    for peer, found, peer_s in (
        ("lsq_linear", box, box_s),
        ("lsq_linear bvls", bvls, bvls_s),
        ("nnls cut at 1", positive, positive_s),
    ):
        aim = "20 times faster" if peer == "lsq_linear" else ""
        yield Row(f"{what}, time of a frame", 1e6 * ours_s, "us", peer, 1e6 * peer_s, aim)
        cost = (_cost(A, frames, ours), _cost(A, frames, found))
        yield Row(f"{what}, mean squared residual", cost[0], "sigma^2", peer, cost[1])
        yield Row(f"{what}, RMSE of weights", _root(ours - true), "", peer, _root(found - true))
    worst = max(kkt_violation(A.T @ A, A.T @ b, w) / np.abs(A.T @ b).max() for b, w in zip(frames, ours, strict=True))
    yield Row(f"{what}, conditions of the minimum, relative", worst, "", aim="1e-6")
    found, whole_s = _in_sequence(solver, take)
    peer_s = _peer_with_all_terms_s(shapes, solver, take, found)
    what = f"{layout} x {len(solver.driven)} shapes driven, with all terms, time of a frame"
    yield Row(what, 1e6 * whole_s, "us", "lsq_linear, the same", 1e6 * peer_s, "20 times faster")


def _timed(solve: Callable[[Array], Array], frames: Array) -> tuple[Array, float]:
    """The answers (T, N) and the median time of one [s]."""
    answers, durations = [], []
    for b in frames:
        start = time.perf_counter()
        answers.append(solve(b))
        durations.append(time.perf_counter() - start)
    return np.array(answers), float(np.median(durations))


def _in_sequence(solver: ShapeSolver, take: _Take) -> tuple[Array, float]:
    """The weights (T, B) and the median time of a frame [s]."""
    solver.reset()
    clock = iter(take.times.tolist())
    return _timed(lambda moved: solver(moved, next(clock)), take.moves)


def _peer_with_all_terms_s(shapes: SiteShapes, solver: ShapeSolver, take: _Take, found: Array) -> float:
    """Median time [s] of lsq_linear on the same frames with the same terms as further rows, from the same past."""
    from scipy.optimize import lsq_linear

    driven = [shapes.shape_names.index(name) for name in solver.driven]
    A = shapes.displacements.reshape(-1, len(shapes.shape_names))[:, driven] / NOISE_M
    pull = SPARSITY * np.linalg.norm(A, axis=0) / (2 * SMOOTHNESS)
    stacked = np.vstack([A, np.sqrt(SMOOTHNESS) * np.eye(len(driven))])
    before = np.vstack([np.zeros(len(driven)), found[:-1, driven]]) - pull
    frames = np.hstack([take.moves.reshape(len(take.moves), -1) / NOISE_M, np.sqrt(SMOOTHNESS) * before])
    answers, peer_s = _timed(lambda b: lsq_linear(stacked, b, (0, 1), tol=1e-12).x, frames[1:PEER_FRAMES])
    if np.abs(answers - found[1:PEER_FRAMES, driven]).max() > 1e-3:
        raise ValueError("The peer solves another problem.")
    return peer_s


def _cost(A: Array, frames: Array, found: Array) -> float:
    return float(((found @ A.T - frames) ** 2).mean())


def _root(error: Array) -> float:
    return float(np.sqrt((error**2).mean()))
