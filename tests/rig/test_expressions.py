"""The rule for expressions, on faces made by hand and on a performer who strays, is tinged and speaks."""

from __future__ import annotations

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.rig.expressions import FOR, ExpressionRule
from retarget.rig.load import load_rig
from retarget.rig.shapes import NOISE_M, ShapeSolver
from retarget.rig.site_shapes import site_shapes
from tests.synthetic.face import ALL_SITES, FACE24_SITES
from tests.synthetic.weights import PROTOTYPES, moves, performance

NAMES = list(load_rig("human").shape_names)
EXPRESSIONS = list(PROTOTYPES)


def face(**shapes: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    weights = np.zeros(len(NAMES))
    for name, weight in shapes.items():
        for i, full in enumerate(NAMES):
            if full.removesuffix("Left").removesuffix("Right") == name or full == name:
                weights[i] = weight
    return weights


@pytest.mark.parametrize(
    ("shapes", "expression"),
    [
        ({}, "neutral"),
        ({"mouthSmile": 0.6}, "joy"),
        ({"mouthSmile": 0.8, "cheekSquint": 0.7, "jawOpen": 0.5}, "joy"),
        ({"browDown": 0.7}, "anger"),
        ({"browDown": 0.5, "noseSneer": 0.6, "mouthPress": 0.4}, "anger"),
        ({"mouthFrown": 0.6, "browInnerUp": 0.5}, "sorrow"),
        ({"browInnerUp": 0.7, "browOuterUp": 0.7, "jawOpen": 0.4}, "surprise"),
        ({"jawOpen": 0.6}, "neutral"),
        ({"eyeBlink": 1.0}, "neutral"),
        ({"mouthPucker": 0.8, "mouthFunnel": 0.5}, "neutral"),
    ],
)
def test_faces_are_called_what_a_person_would_call_them(shapes: dict[str, float], expression: str) -> None:
    assert ExpressionRule(NAMES)(face(**shapes)).expression == expression


@pytest.mark.parametrize("expression", FOR)
def test_a_full_expression_scores_about_1_and_grows_with_its_strength(expression: str) -> None:
    rule = ExpressionRule(NAMES)
    shapes = PROTOTYPES[expression]  # type: ignore[index]
    half, full = (rule(face(**{k: s * v for k, v in shapes.items()})).scores for s in (0.5, 1.0))
    assert full[expression] == max(full.values())  # type: ignore[index]
    assert 0.45 < full[expression] < 1.1  # type: ignore[index]
    assert full[expression] == pytest.approx(2 * half[expression])  # type: ignore[index]


def test_one_side_alone_counts_half() -> None:
    rule = ExpressionRule(NAMES)
    both, left = rule(face(mouthSmile=0.8)), rule(face(mouthSmileLeft=0.8))
    assert left.scores["joy"] == pytest.approx(0.5 * both.scores["joy"])


def test_shapes_that_the_markers_cannot_tell_are_left_out_of_the_mean() -> None:
    few = ExpressionRule(NAMES, observed=("mouthSmileLeft", "mouthSmileRight"))
    assert few.known == ("joy",)
    assert few(face(mouthSmile=0.7)).scores["joy"] == pytest.approx(0.7)
    assert few(face(browDown=1.0)).expression == "neutral"


def test_a_rig_whose_shapes_tell_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="mouthSmile"):
        ExpressionRule(["Fcl_ALL_Joy", "A", "I"])


@pytest.mark.parametrize("sites", [FACE24_SITES, ALL_SITES], ids=["24 markers", "41 markers"])
def test_from_noisy_markers_most_of_a_performance_is_called_right_and_nothing_grossly_wrong(
    sites: tuple[str, ...],
) -> None:
    shapes = site_shapes(load_rig("human"), sites)
    solver = ShapeSolver(shapes)
    rule = ExpressionRule(NAMES, solver.driven)
    confusion = np.zeros((5, 5), int)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        played = performance(NAMES, rng, rate_hz=30.0)
        solver.reset()
        for t, moved in enumerate(moves(shapes, played.weights, rng, NOISE_M)):
            found = rule(solver(moved, float(played.times[t])))
            if played.held[t]:
                confusion[EXPRESSIONS.index(played.labels[t]), EXPRESSIONS.index(found.expression)] += 1
    share = confusion / confusion.sum(axis=1, keepdims=True)
    assert share.diagonal().mean() > 0.85
    assert share.diagonal().min() > 0.65
    emotions = share[1:, 1:]
    assert (emotions - np.diag(emotions.diagonal())).max() < 0.12
