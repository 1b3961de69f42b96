"""Known weights go through the rig's own shapes to the sites, and come back."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.rig.load import load_rig
from retarget.rig.shapes import NOISE_M, ShapeSolver
from retarget.rig.site_shapes import SiteShapes, site_shapes
from tests.synthetic.face import ALL_SITES, FACE24_SITES
from tests.synthetic.motion import smooth_noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

SITES = {"face24": FACE24_SITES, "all": ALL_SITES}


@cache
def seen_at(layout: str) -> SiteShapes:
    return site_shapes(load_rig("human"), SITES[layout])


def known_weights(solver: ShapeSolver, shapes: SiteShapes, seed: int, seconds: float = 3.0) -> tuple[Array, Array]:
    """Times (T,) and weights (T, B): about one shape in six on at a time, only such as the sites can tell."""
    rng = np.random.default_rng(seed)
    times = np.arange(round(60 * seconds)) / 60
    weights = np.zeros((len(times), len(shapes.shape_names)))
    for name in solver.driven:
        weights[:, shapes.shape_names.index(name)] = np.clip(smooth_noise(times, rng, (0.2, 1.5), 0.5) - 0.5, 0, 1)
    return times, weights


def solved(solver: ShapeSolver, moves: Array, times: Array) -> Array:
    return np.array([solver(m, t) for m, t in zip(moves, times.tolist(), strict=True)])


@pytest.mark.parametrize("layout", SITES)
def test_without_noise_and_without_other_terms_the_weights_come_back(layout: str) -> None:
    shapes = seen_at(layout)
    solver = ShapeSolver(shapes, smoothness=0.0, sparsity=0.0)
    times, weights = known_weights(solver, shapes, 1)
    moves = np.einsum("tb,scb->tsc", weights, shapes.displacements)
    np.testing.assert_allclose(solved(solver, moves, times), weights, atol=1e-4)


@pytest.mark.parametrize(("layout", "limit"), [("face24", 0.05), ("all", 0.05)])
def test_with_noise_of_0_3_mm_they_come_back_roughly_and_the_face_closely(layout: str, limit: float) -> None:
    shapes = seen_at(layout)
    solver = ShapeSolver(shapes)
    times, weights = known_weights(solver, shapes, 2)
    true_moves = np.einsum("tb,scb->tsc", weights, shapes.displacements)
    noisy = true_moves + np.random.default_rng(3).normal(scale=NOISE_M, size=true_moves.shape)
    found = solved(solver, noisy, times)
    driven = [shapes.shape_names.index(name) for name in solver.driven]
    assert np.sqrt(((found - weights)[:, driven] ** 2).mean()) < limit
    moves = np.einsum("tb,scb->tsc", found, shapes.displacements)
    assert np.linalg.norm(moves - true_moves, axis=2).mean() < 0.0007


def test_sites_that_are_not_seen_drop_out_and_the_others_still_tell() -> None:
    shapes = seen_at("all")
    solver = ShapeSolver(shapes, smoothness=0.0, sparsity=0.0)
    weights = np.zeros(len(shapes.shape_names))
    weights[shapes.shape_names.index("mouthSmileLeft")] = 0.6
    moves = shapes.displacements @ weights
    moves[shapes.sites.index("lipCornerLeft")] = np.nan
    moves[shapes.sites.index("chin")] = np.nan
    np.testing.assert_allclose(solver(moves, 0.0), weights, atol=1e-4)


@pytest.mark.parametrize("rate_hz", [24.0, 60.0, 120.0])
def test_when_nothing_is_seen_the_face_eases_to_rest_at_any_rate(rate_hz: float) -> None:
    shapes = seen_at("all")
    solver = ShapeSolver(shapes)
    smile = shapes.shape_names.index("mouthSmileLeft")
    moves = shapes.displacements[:, :, smile]
    for i in range(10):
        weights = solver(moves, i / rate_hz)
    assert weights[smile] > 0.9
    lost = [solver(np.full_like(moves, np.nan), (10 + i) / rate_hz) for i in range(round(rate_hz))]
    path = np.array(lost)[:, smile] / weights[smile]
    np.testing.assert_allclose(path, np.exp(-(1 + np.arange(len(path))) / rate_hz / 0.25), atol=1e-3)


def test_what_is_seen_stays_while_what_is_hidden_eases_to_rest() -> None:
    shapes = seen_at("all")
    solver = ShapeSolver(shapes)
    smile, brow = (shapes.shape_names.index(name) for name in ("mouthSmileLeft", "browInnerUp"))
    moves = 0.6 * shapes.displacements[:, :, smile] + 0.6 * shapes.displacements[:, :, brow]
    for i in range(30):
        both = solver(moves, i / 60)
    moves[[not site.startswith(("brow", "forehead")) for site in shapes.sites]] = np.nan
    for i in range(30, 90):
        half = solver(moves, i / 60)
    assert both[smile] > 0.5
    assert half[smile] < 0.3 * both[smile]
    assert half[brow] == pytest.approx(both[brow], abs=0.05)


def test_a_doubled_frame_gives_the_same_weights_and_reset_forgets() -> None:
    shapes = seen_at("face24")
    solver = ShapeSolver(shapes)
    open_jaw, smile = (shapes.displacements[:, :, shapes.shape_names.index(n)] for n in ("jawOpen", "mouthSmileLeft"))
    first = solver(open_jaw, 1.0)
    second = solver(smile, 1.02)
    np.testing.assert_array_equal(solver(open_jaw, 1.02), second)
    solver.reset()
    np.testing.assert_array_equal(solver(open_jaw, 0.0), first)


def test_shapes_that_the_sites_cannot_tell_are_named_and_stay_at_0() -> None:
    few, many = ShapeSolver(seen_at("face24")), ShapeSolver(seen_at("all"))
    assert "tongueOut" in few.frozen
    assert "tongueOut" in many.frozen
    assert {"eyeBlinkLeft", "eyeBlinkRight"} <= set(few.frozen)  # there are no markers at the lids
    assert {"eyeBlinkLeft", "eyeBlinkRight"} <= set(many.driven)
    for solver, layout in ((few, "face24"), (many, "all")):
        assert {*solver.driven} | {*solver.frozen} == {*seen_at(layout).shape_names}
        assert not {*solver.driven} & {*solver.frozen}
        frozen = [seen_at(layout).shape_names.index(name) for name in solver.frozen]
        moves = np.random.default_rng(0).normal(scale=0.01, size=(len(SITES[layout]), 3))
        assert not solver(moves, 0.0)[frozen].any()


def test_of_two_shapes_that_do_the_same_one_is_driven() -> None:
    displacements = np.zeros((2, 3, 3))
    displacements[0, 1, :2] = 0.01
    displacements[1, 0, 2] = 0.01
    solver = ShapeSolver(SiteShapes(("a", "b"), ("one", "twin", "other"), displacements))
    assert len(solver.driven) == 2
    assert "other" in solver.driven


def test_opposite_shapes_are_both_driven() -> None:
    displacements = np.zeros((1, 3, 2))
    displacements[0, 0] = [0.01, -0.01]
    solver = ShapeSolver(SiteShapes(("chin",), ("jawLeft", "jawRight"), displacements), smoothness=0, sparsity=0)
    np.testing.assert_allclose(solver(np.array([[-0.004, 0, 0]]), 0.0), [0.0, 0.4], atol=1e-6)


def test_shapes_that_are_left_out_are_neither_driven_nor_called_frozen() -> None:
    solver = ShapeSolver(seen_at("all"), without=("jawOpen",))
    assert "jawOpen" not in solver.driven + solver.frozen


def test_sites_that_show_nothing_are_an_error_in_one_sentence() -> None:
    with pytest.raises(InputError, match=r"forehead.*drive the joints"):
        ShapeSolver(site_shapes(load_rig("human"), ("forehead",)), without=seen_at("all").shape_names[:-1])
