"""Painting: texels know their triangle, noise repeats, layers mix."""

from __future__ import annotations

import numpy as np
import pytest

from rigs.recipe.atlas import pack
from rigs.recipe.noise import fractal, value_noise
from rigs.recipe.paint import blend, canvas, smoothstep

HALVES = np.array([[[0.0, 0], [1, 0], [0, 1]], [[1.0, 0], [1, 1], [0, 1]]])
"""Two triangles that cover the whole picture."""


def test_every_texel_is_given_its_own_place() -> None:
    layer = canvas(HALVES, 32)
    assert layer.covered.all()
    middles = (np.arange(32) + 0.5) / 32
    place = layer.sample(HALVES).reshape(32, 32, 2)
    np.testing.assert_allclose(place[..., 0], np.tile(middles, (32, 1)), atol=1e-9)
    np.testing.assert_allclose(place[..., 1], np.tile(middles[:, None], (1, 32)), atol=1e-9)


def test_texels_outside_repeat_the_nearest_colour() -> None:
    layer = canvas(HALVES[:1] / 2, 16)
    assert not layer.covered.all()
    picture = layer.picture(np.tile([10.0, 20, 30], (len(layer.triangle), 1)))
    assert (picture == [10, 20, 30]).all()


def test_noise_is_bounded_smooth_and_the_same_every_time() -> None:
    points = np.random.default_rng(1).uniform(-50, 50, (2000, 3))
    values = value_noise(points, 4.0, seed=3)
    assert np.abs(values).max() <= 1
    assert values.std() > 0.2
    np.testing.assert_array_equal(values, value_noise(points, 4.0, seed=3))
    assert np.abs(value_noise(points + 1e-4, 4.0, seed=3) - values).max() < 1e-3
    assert not np.allclose(values, value_noise(points, 4.0, seed=4))


def test_fractal_noise_has_finer_detail_than_its_first_layer() -> None:
    line = np.zeros((500, 3))
    line[:, 0] = np.linspace(0, 20, 500)
    rough, plain = fractal(line, 5.0, 4, seed=2), value_noise(line, 5.0, seed=2)
    assert np.abs(np.diff(rough)).sum() > 1.5 * np.abs(np.diff(plain)).sum()


def test_smoothstep_rises_or_falls_between_its_ends() -> None:
    np.testing.assert_allclose(smoothstep(0, 2, np.array([-1.0, 0, 1, 2, 3])), [0, 0, 0.5, 1, 1])
    np.testing.assert_allclose(smoothstep(2, 0, np.array([-1.0, 0, 1, 2, 3])), [1, 1, 0.5, 0, 0])


def test_blend_mixes_by_opacity() -> None:
    mixed = blend(np.zeros((3, 3)), (100.0, 100.0, 100.0), np.array([0.0, 0.25, 2.0]))
    np.testing.assert_allclose(mixed[:, 0], [0, 25, 100])


def test_a_triangle_on_no_island_is_refused() -> None:
    with pytest.raises(ValueError, match="outside every known island"):
        pack(np.full((1, 3, 2), 0.5))
