"""Light adds up as it should: sRGB against its standard's own points, and simple normals whose light is known."""

from __future__ import annotations

import numpy as np
import pytest

from retarget.rig.display import shading

FRONT = np.eye(3, dtype=np.float32)


def test_srgb_of_known_light() -> None:
    # IEC 61966-2-1: the middle grey of 18 % is 118 of 255, and 128 is 21.6 % of the light.
    assert round(float(shading.srgb_from_linear(0.18)) * 255) == 118
    assert float(shading.linear_from_srgb(128 / 255)) == pytest.approx(0.2159, abs=1e-4)


def test_encoding_and_decoding_are_inverse_for_every_byte() -> None:
    bytes_ = np.arange(256) / 255
    assert shading.srgb_from_linear(shading.linear_from_srgb(bytes_)) == pytest.approx(bytes_, abs=1e-5)


def test_light_beyond_white_is_clipped() -> None:
    assert shading.srgb_from_linear([-1.0, 2.0]).tolist() == pytest.approx([0.0, 1.0])


def test_the_side_towards_the_key_light_is_brighter() -> None:
    key = shading.LIGHT_DIRECTIONS[0]
    lit, dark = shading.diffuse(np.stack([key, -key]), FRONT).mean(axis=1)
    assert lit > 3 * dark
    assert dark > 0.02


def test_lights_travel_with_the_camera() -> None:
    half_turn = np.diag([-1, 1, -1]).astype(np.float32)
    normal = np.array([[0.3, 0.2, 0.9]], np.float32)
    assert shading.diffuse(normal @ half_turn, half_turn) == pytest.approx(shading.diffuse(normal, FRONT))


def test_a_white_surface_before_the_camera_is_bright_and_not_clipped() -> None:
    normal = np.array([[0.0, 0.0, 1.0]], np.float32)
    light = shading.diffuse(normal, FRONT) + shading.gloss(normal, FRONT, 0.8)
    assert light.min() > 0.5
    assert light.max() < 1.0


def test_a_smoother_surface_has_a_narrower_and_brighter_gloss() -> None:
    half = shading.LIGHT_DIRECTIONS[0] + np.array([0, 0, 1], np.float32)
    peak = (half / np.linalg.norm(half))[None]
    aside = np.array([[0.6, -0.6, 0.53]], np.float32)
    smooth, rough = (shading.gloss(np.concatenate([peak, aside]), FRONT, r)[:, 0] for r in (0.25, 0.9))
    assert smooth[0] > 2 * rough[0]
    assert smooth[1] < rough[1]
