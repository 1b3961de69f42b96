"""Keys and mouse, without a screen."""

from __future__ import annotations

import math

import pytest

from retarget.rig.display.controls import Controls
from retarget.rig.display.view import View

HOME = View(640, 480, framing="face", yaw_rad=0.2)


@pytest.mark.parametrize("key", ["q", "escape"])
def test_q_and_escape_quit(key: str) -> None:
    controls = Controls(HOME)
    controls.press(key)
    assert controls.quit_asked


def test_space_freezes_and_goes_on_and_h_shows_and_hides_help() -> None:
    controls = Controls(HOME)
    states = []
    for key in ("space", "h", "space", "h"):
        controls.press(key)
        states.append((controls.frozen, controls.shows_help))
    assert states == [(True, False), (True, True), (False, True), (False, False)]


def test_other_keys_change_nothing() -> None:
    controls = Controls(HOME)
    for key in ("x", "lshift", "f11", ""):
        controls.press(key)
    assert controls.view == HOME
    assert not any((controls.quit_asked, controls.frozen, controls.shows_help, controls.picture_asked))


def test_the_face_follows_the_mouse() -> None:
    controls = Controls(HOME)
    controls.drag(50, 0)
    assert controls.view.yaw_rad < HOME.yaw_rad  # the camera goes to the face's right, so that it turns to its left
    controls.drag(0, 20)
    assert controls.view.pitch_rad < 0  # the camera sinks, so that the face looks up


def test_the_camera_never_tips_over_and_yaw_stays_small() -> None:
    controls = Controls(HOME)
    for _ in range(100):
        controls.drag(333, -1000)
    assert math.radians(80) < controls.view.pitch_rad < math.pi / 2
    assert abs(controls.view.yaw_rad) <= math.pi


def test_the_wheel_comes_nearer_up_to_a_limit_and_goes_away_again() -> None:
    controls = Controls(HOME)
    controls.turn_wheel(1)
    assert controls.view.zoom > 1
    controls.turn_wheel(-1)
    assert controls.view.zoom == pytest.approx(1)
    controls.turn_wheel(1000)
    nearest = controls.view.zoom
    controls.turn_wheel(-5000)
    assert controls.view.zoom < 1 < nearest < 20


def test_r_brings_the_camera_back_and_keeps_the_windows_size() -> None:
    controls = Controls(HOME)
    controls.resize(300, 200)
    controls.drag(70, 30)
    controls.turn_wheel(3)
    controls.press("r")
    assert (controls.view.width, controls.view.height) == (300, 200)
    assert (controls.view.yaw_rad, controls.view.pitch_rad, controls.view.zoom) == (0.2, 0.0, 1.0)


@pytest.mark.parametrize("size", [(1, 1), (100_000, 20), (0, 0)])
def test_a_window_of_any_size_can_be_drawn(size: tuple[int, int]) -> None:
    controls = Controls(HOME)
    controls.resize(*size)
    assert 16 <= controls.view.width <= 8192
    assert 16 <= controls.view.height <= 8192
