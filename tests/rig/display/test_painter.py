"""The painting thread draws the newest wish, each once, and tells what went wrong."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from retarget.errors import DisplayError, InputError
from retarget.rig.display.offscreen import Offscreen
from retarget.rig.display.painter import Painter
from retarget.rig.display.view import View
from retarget.rig.skinning import Skin
from tests.rig.display.heads import head_pose, head_rig

if TYPE_CHECKING:
    from retarget.frames import Pose
    from retarget.rig.skinning import Deformed

pytestmark = pytest.mark.usefixtures("egl")

RIG = head_rig()
VIEW = View(64, 48)
LONG_S = 30.0


def test_the_first_picture_needs_no_wish_and_the_same_wish_is_drawn_once() -> None:
    pose = head_pose(RIG, number=7)
    with Painter(RIG, VIEW, pose) as painter:
        painted = painter.next_picture(LONG_S)
        painter.want(pose, VIEW)
        assert painter.next_picture(0.2) is None
    assert painted is not None
    assert painted.pose is pose
    with Offscreen(RIG, VIEW) as offscreen:
        assert (painted.picture == offscreen.render(pose)).all()


def test_a_new_view_of_the_same_pose_is_drawn() -> None:
    pose, wider = head_pose(RIG), replace(VIEW, width=128)
    with Painter(RIG, VIEW, pose) as painter:
        painter.next_picture(LONG_S)
        painter.want(pose, wider)
        painted = painter.next_picture(LONG_S)
    assert painted is not None
    assert painted.picture.shape == (48, 128, 3)


def test_only_the_newest_of_many_poses_is_drawn() -> None:
    skin, drawn, gate = Skin(RIG), [], threading.Event()

    def slow_skin(pose: Pose) -> Deformed:
        drawn.append(pose.number)
        gate.wait(LONG_S)
        return skin(pose)

    with Painter(RIG, VIEW, head_pose(RIG, number=0), slow_skin) as painter:
        while not drawn:
            threading.Event().wait(0.001)
        for number in range(1, 100):
            painter.want(head_pose(RIG, number=number), VIEW)
        gate.set()
        while (painted := painter.next_picture(LONG_S)) and painted.pose.number != 99:
            pass
    assert drawn == [0, 99]


def test_what_stops_the_drawing_is_told_to_who_waits_for_pictures() -> None:
    def broken(pose: Pose) -> Deformed:
        raise ValueError("a knot in the skin")

    with pytest.raises(DisplayError, match="a knot in the skin"), Painter(RIG, VIEW, head_pose(RIG), broken) as painter:
        painter.next_picture(LONG_S)


def test_an_error_of_ours_comes_as_it_is() -> None:
    def refusing(pose: Pose) -> Deformed:
        raise InputError("This pose is for another rig.")

    with pytest.raises(InputError, match="another rig"), Painter(RIG, VIEW, head_pose(RIG), refusing) as painter:
        painter.next_picture(LONG_S)
