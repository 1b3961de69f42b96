"""What the picture must hold is inside it, and fills it. Points are projected here, from the camera's own numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.geometry import apply, inverse
from retarget.rig.display.camera import Camera, camera_for, subject
from retarget.rig.display.view import View
from tests.rig.display.heads import CENTRE, RADII, head_rig

if TYPE_CHECKING:
    from numpy.typing import NDArray

RIG = head_rig()


def projected(camera: Camera, view: View, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 2): right and up in [-1, 1] between the edges of the picture."""
    x, y, z = apply(inverse(camera.T_rig_camera), points).T
    height = np.tan(camera.yfov_rad / 2)
    return np.stack([x / -z / (height * view.width / view.height), y / -z / height], axis=1)


@pytest.mark.parametrize("framing", ["face", "head", "bust"])
@pytest.mark.parametrize("size", [(640, 480), (480, 640), (1280, 720)])
@pytest.mark.parametrize("turn", [(0.0, 0.0), (1.2, 0.0), (0.0, -1.0), (3.0, 1.5)])
def test_the_subject_is_inside_the_picture_and_fills_it(
    framing: str, size: tuple[int, int], turn: tuple[float, float]
) -> None:
    view = View(*size, framing=framing, yaw_rad=turn[0], pitch_rad=turn[1])  # type: ignore[arg-type]
    reach = np.abs(projected(camera_for(RIG, view), view, subject(RIG, view))).max()
    assert 0.6 < reach < 1.0


def test_every_point_lies_between_the_near_and_the_far_plane() -> None:
    for view in (View(), View(yaw_rad=2.0, pitch_rad=1.5), View(framing="face", zoom=3)):
        camera = camera_for(RIG, view)
        points = np.concatenate([s.positions for s in RIG.surfaces]).astype(float)
        depth = -apply(inverse(camera.T_rig_camera), points)[:, 2]
        assert 0 < camera.near < depth.min()
        assert depth.max() < camera.far


def test_the_camera_stands_before_the_face_and_upright() -> None:
    camera = camera_for(RIG, View())
    assert camera.T_rig_camera[:3, :3] == pytest.approx(np.eye(3))
    assert camera.T_rig_camera[2, 3] > CENTRE[2] + RADII[2]


def test_a_positive_yaw_walks_to_the_characters_left() -> None:
    assert camera_for(RIG, View(yaw_rad=0.5)).T_rig_camera[0, 3] > 0.1


def test_a_positive_pitch_climbs() -> None:
    assert camera_for(RIG, View(pitch_rad=0.5)).T_rig_camera[1, 3] > CENTRE[1] + 0.1


def test_zooming_in_twice_as_near_halves_the_distance() -> None:
    centre = (RIG.surfaces[0].positions.min(axis=0) + RIG.surfaces[0].positions.max(axis=0)) / 2
    far, near = (camera_for(RIG, View(zoom=z)).T_rig_camera[2, 3] for z in (1, 2))
    assert near - centre[2] == pytest.approx((far - centre[2]) / 2, abs=0.01)


def test_the_head_leaves_out_what_hangs_on_the_neck() -> None:
    skin, mark = RIG.surfaces
    below = np.zeros_like(mark.joints)
    rig = replace(RIG, surfaces=(skin, replace(mark, joints=below, positions=mark.positions - np.float32(0.15))))
    head, bust = (subject(rig, View(framing=framing)) for framing in ("head", "bust"))
    assert len(head) == len(skin.positions) + 1  # and the place of an open mouth's chin
    assert len(bust) == len(skin.positions) + len(mark.positions)


def test_an_open_mouth_stays_in_the_picture() -> None:
    view = View(framing="head")
    chin = CENTRE - [0.0, RADII[1] * 1.15, -0.05]
    assert np.abs(projected(camera_for(RIG, view), view, chin[None])).max() < 1
