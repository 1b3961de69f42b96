"""Pictures of a head of known solids: what is where, in which colour, and that nothing stays behind in memory."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import DisplayError
from retarget.geometry import quat_from_axis_angle, quat_multiply
from retarget.rig.display import shading
from retarget.rig.display.camera import camera_for
from retarget.rig.display.offscreen import Offscreen
from retarget.rig.display.platform import Context
from retarget.rig.display.view import View
from retarget.rig.load import load_rig
from retarget.rig.model import Material
from retarget.rig.posing import rest_pose
from tests.rig.display.heads import CENTRE, RADII, SKIN_COLOR, head_pose, head_rig

if TYPE_CHECKING:
    from numpy.typing import NDArray

pytestmark = pytest.mark.usefixtures("egl")

GREEN = (0, 255, 0)
SMALL = View(160, 120, supersampling=1)


def picture_of(material: Material | None = None, view: View = SMALL) -> NDArray[np.uint8]:
    rig = head_rig(material)
    with Offscreen(rig, view) as offscreen:
        return offscreen.render(rest_pose(rig))


def covered(picture: NDArray[np.uint8], background: tuple[int, int, int] = GREEN) -> NDArray[np.bool_]:
    return np.asarray((picture != np.array(background)).any(axis=-1))


def redness(picture: NDArray[np.uint8]) -> NDArray[np.bool_]:
    red, green, blue = np.moveaxis(picture.astype(int), -1, 0)
    return np.asarray((red > 120) & (red > 3 * green) & (red > 3 * blue))


@pytest.mark.parametrize("supersampling", [1, 2, 3])
@pytest.mark.parametrize("background", [GREEN, (12, 34, 56), (255, 255, 255)])
def test_the_background_is_exact(background: tuple[int, int, int], supersampling: int) -> None:
    picture = picture_of(view=View(120, 100, background, supersampling=supersampling))
    assert picture.shape == (100, 120, 3)
    for corner in (picture[0, 0], picture[0, -1], picture[-1, 0], picture[-1, -1]):
        assert tuple(corner) == background


def test_the_face_covers_the_share_that_its_outline_has() -> None:
    view = View(320, 240, supersampling=1)
    distance = camera_for(head_rig(), view).T_rig_camera[2, 3]
    # The outline of the ellipsoid x^2/a^2 + y^2/b^2 + z^2/c^2 = 1 from (0, 0, d) is an ellipse with half-axes
    # a / sqrt(d^2 - c^2) and b / sqrt(d^2 - c^2) at unit distance.
    unit = np.sqrt(distance**2 - RADII[2] ** 2)
    pixels_per_unit = 240 / 2 / np.tan(camera_for(head_rig(), view).yfov_rad / 2)
    expected = np.pi * RADII[0] * RADII[1] / unit**2 * pixels_per_unit**2
    assert covered(picture_of(view=view)).sum() == pytest.approx(expected, rel=0.02)


def test_the_characters_left_is_on_the_pictures_right_and_up_is_up() -> None:
    rows, columns = np.nonzero(redness(picture_of()))
    assert columns.mean() > 160 * 0.6
    assert rows.mean() < 120 * 0.5


@pytest.mark.parametrize("shading_kind", ["vertex", "pixel"])
def test_the_head_turns_to_its_left_by_a_positive_yaw(shading_kind: str) -> None:
    rig = head_rig()
    with Offscreen(rig, replace(SMALL, shading=shading_kind)) as offscreen:  # type: ignore[arg-type]
        before, after = (np.nonzero(redness(offscreen.render(head_pose(rig, yaw)))) for yaw in (0.0, 0.4))
    assert after[1].mean() > before[1].mean() + 5


def test_the_same_pose_gives_the_same_pixels_and_another_pose_other_ones() -> None:
    rig = head_rig()
    with Offscreen(rig, SMALL) as offscreen:
        first = offscreen.render(head_pose(rig))
        moved = offscreen.render(head_pose(rig, chin=1.0))
        again = offscreen.render(head_pose(rig))
    with Offscreen(rig, SMALL) as other:
        anew = other.render(head_pose(rig))
    assert (first == again).all()
    assert (first == anew).all()
    assert covered(moved).sum() > covered(first).sum() + 100
    assert (first[:40] == moved[:40]).all()  # the brow does not follow the chin


def test_a_plain_surface_has_the_colour_that_its_light_says() -> None:
    picture = picture_of(view=replace(SMALL, shading="vertex"))
    rig = head_rig()
    skin = rig.surfaces[0]
    point = CENTRE + RADII * [0.0, 0.6, 0.8]
    nearest = int(np.argmin(np.linalg.norm(skin.positions - point, axis=1)))
    front, normal = np.eye(3, dtype=np.float32), skin.normals[nearest][None]
    light = np.array(SKIN_COLOR[:3], np.float32) * shading.diffuse(normal, front) + shading.gloss(normal, front, 0.8)
    expected = shading.srgb_from_linear(light)[0] * 255
    assert picture[pixel_of(skin.positions[nearest])] == pytest.approx(expected, abs=3)


@pytest.mark.parametrize("shading_kind", ["vertex", "pixel"])
def test_a_texture_is_shown_as_bright_as_a_plain_colour_of_its_light(shading_kind: str) -> None:
    grey = np.full((8, 8, 4), 255, np.uint8)
    grey[..., :3] = 128
    linear = float(shading.linear_from_srgb(128 / 255))
    view = replace(SMALL, shading=shading_kind)  # type: ignore[arg-type]
    textured = picture_of(Material(texture=grey), view)
    plain = picture_of(Material(base_color=(linear, linear, linear, 1.0)), view)
    assert np.abs(textured.astype(int) - plain).max() <= 4


def test_light_per_vertex_looks_like_light_per_pixel() -> None:
    pictures = [picture_of(view=replace(SMALL, shading=kind)).astype(int) for kind in ("vertex", "pixel")]
    skin = covered(pictures[0].astype(np.uint8)) & covered(pictures[1].astype(np.uint8))
    assert np.abs(pictures[0] - pictures[1])[skin].mean() < 20


def test_a_texture_lies_the_right_way_round() -> None:
    quarters = np.full((16, 16, 4), 255, np.uint8)
    quarters[:8, 8:, :3] = (255, 0, 0)  # the upper half of the character's left
    quarters[8:, :, :3] = (0, 0, 255)
    picture = picture_of(Material(texture=quarters))
    upper, lower = pixel_of(CENTRE + RADII * [0, 0.5, 0.87]), pixel_of(CENTRE + RADII * [0, -0.5, 0.87])
    left, right = picture[upper[0], upper[1] + 12].astype(int), picture[upper[0], upper[1] - 12].astype(int)
    assert left[0] > 2 * left[1]
    assert abs(right[0] - right[1]) < 40
    assert picture[lower][2] > 2 * int(picture[lower][0])


def test_what_is_masked_out_shows_the_background() -> None:
    hole = np.full((8, 8, 4), 255, np.uint8)
    hole[..., 3] = 100
    picture = picture_of(Material(texture=hole, alpha_mode="MASK"))
    assert covered(picture).sum() < 300  # the red ball alone


def test_half_transparent_skin_lets_the_background_through() -> None:
    glass = picture_of(Material(base_color=(1.0, 1.0, 1.0, 0.5), alpha_mode="BLEND"))
    middle = glass[60, 80].astype(int)
    assert middle[1] > middle[0] + 60
    assert middle[0] > 60


def test_supersampling_smooths_the_outline_and_keeps_its_place() -> None:
    rough, smooth = (picture_of(view=View(160, 120, supersampling=n)) for n in (1, 3))
    assert abs(int(covered(rough).sum()) - int(covered(smooth).sum())) < 400
    between = (smooth[..., 1] > 190) & covered(smooth)
    assert between.sum() > 100
    assert not ((rough[..., 1] > 190) & covered(rough)).any()


def test_a_graphics_card_lights_every_pixel_and_smooths_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    by_pixel = picture_of(view=replace(SMALL, shading="pixel"))
    monkeypatch.setattr(Context, "is_software", False)
    card = picture_of()
    assert tuple(card[0, 0]) == GREEN
    assert ((card[..., 1] > 190) & covered(card)).sum() > 100  # edges between face and ground
    inside = (by_pixel[..., 1] < 190) & (card[..., 1] < 190)
    assert np.abs(card.astype(int) - by_pixel)[inside].mean() < 2


def test_the_human_opens_the_mouth_and_leaves_the_brow_alone() -> None:
    rig = load_rig("human")
    assert rig.jaw is not None
    rest = rest_pose(rig)
    turn = quat_from_axis_angle(rig.jaw.axis, np.deg2rad(20))
    rotations = rest.rotations.copy()
    rotations[rig.jaw.joint] = quat_multiply(rotations[rig.jaw.joint], turn)
    view = View(240, 240, supersampling=1)
    with Offscreen(rig, view) as offscreen:
        shut, wide = offscreen.render(rest), offscreen.render(replace(rest, rotations=rotations))
    assert 0.25 < covered(shut).mean() < 0.6
    for picture in (shut, wide):
        for corner in (picture[0, 0], picture[0, -1], picture[-1, 0], picture[-1, -1]):
            assert tuple(corner) == GREEN
    changed = (shut != wide).any(axis=-1)
    assert changed[160:].sum() > 1000
    assert not changed[:90].any()


def test_a_new_view_takes_effect_at_the_next_picture() -> None:
    rig = head_rig()
    with Offscreen(rig, SMALL) as offscreen:
        offscreen.render(rest_pose(rig))
        offscreen.view = View(90, 200, (1, 2, 3), yaw_rad=np.pi)
        behind = offscreen.render(rest_pose(rig))
    assert behind.shape == (200, 90, 3)
    assert tuple(behind[0, 0]) == (1, 2, 3)
    assert not redness(behind).any()


def test_two_displays_draw_in_turn_and_one_outlives_the_other() -> None:
    rig = head_rig()
    with Offscreen(rig, SMALL) as first:
        expected = first.render(rest_pose(rig))
        with Offscreen(rig, View(64, 64)) as second:
            assert second.render(rest_pose(rig)).shape == (64, 64, 3)
            assert (first.render(rest_pose(rig)) == expected).all()
        assert (first.render(rest_pose(rig)) == expected).all()


def test_a_display_may_be_used_by_another_thread_than_opened_it() -> None:
    rig = head_rig()
    pictures: list[NDArray[np.uint8]] = []
    with Offscreen(rig, SMALL) as offscreen:
        expected = offscreen.render(rest_pose(rig))
        thread = threading.Thread(target=lambda: pictures.append(offscreen.render(rest_pose(rig))))
        thread.start()
        thread.join()
        assert (offscreen.render(rest_pose(rig)) == expected).all()
    assert (pictures[0] == expected).all()


def test_a_closed_display_says_so() -> None:
    rig = head_rig()
    with Offscreen(rig, SMALL) as offscreen:
        pass
    offscreen.close()
    with pytest.raises(DisplayError, match="closed"):
        offscreen.render(rest_pose(rig))


def test_memory_stays_flat_over_hundreds_of_pictures_and_dozens_of_displays() -> None:
    rig = head_rig()
    with Offscreen(rig, View(64, 48)) as offscreen:
        for i in range(50):
            offscreen.render(head_pose(rig, yaw_rad=i / 50))
        before = resident_bytes()
        for i in range(300):
            offscreen.render(head_pose(rig, yaw_rad=i / 300))
        assert resident_bytes() - before < 4e6
    large = View(640, 480)  # 10 MB of buffers
    for _ in range(3):
        picture_of(view=large)
    before = resident_bytes()
    for _ in range(10):
        picture_of(view=large)
    assert resident_bytes() - before < 30e6


def resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


def pixel_of(point: NDArray[np.floating], view: View = SMALL) -> tuple[int, int]:
    """Row and column of a point (3,), ``rig``, seen from straight ahead."""
    camera = camera_for(head_rig(), view)
    x, y, z = np.asarray(point, float) - camera.T_rig_camera[:3, 3]
    scale = view.height / 2 / np.tan(camera.yfov_rad / 2) / -z
    return int(view.height / 2 - y * scale), int(view.width / 2 + x * scale)
