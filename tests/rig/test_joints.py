"""The joint mapping, one rule at a time; whole performances are in `tests.test_synthetic_truth`."""

from __future__ import annotations

import datetime
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget import geometry
from retarget.errors import InputError
from retarget.frames import MarkerFrame, MarkerLayout
from retarget.performer import Performer, PerformerJaw, gain_matrix
from retarget.rig.joints import JAW_SITES, NECK_SHARE, JointMapping
from retarget.rig.model import Site
from tests.synthetic.places import head_turn, joint_transforms, site_places
from tests.synthetic.rig import small_rig

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import Pose
    from retarget.rig.model import Rig

    Array = NDArray[np.float64]
    Axes = Literal["plain", "turned"]

SCALE = 0.8
SITES = ("browInnerLeft", "lipCornerRight", "lipLower", "mandibleLeft", "chin")
both_axes = pytest.mark.parametrize("axes", ["plain", "turned"])


def layout_of(*sites: str) -> MarkerLayout:
    return MarkerLayout("test", tuple(f"marker{i}" for i in range(len(sites))), sites)


def performer_for(rig: Rig, layout: MarkerLayout, **changes: object) -> Performer:
    """The rig's own face at another size, so that the marker of a site is at the site's rest over `SCALE`."""
    neutral = np.array([rig.sites[site].rest if site in rig.sites else np.zeros(3) for site in layout.sites]) / SCALE
    jaw = rig.jaw
    assert jaw is not None
    performer = Performer(
        name="ana",
        rig=rig.name,
        layout=layout.name,
        date=datetime.date(2026, 1, 1),
        markers=layout.names,
        head_markers=(),
        neutral=neutral,
        noise=np.zeros(len(neutral)),
        scale=SCALE,
        K={},
        jaw=PerformerJaw(jaw.axis, jaw.pivot / SCALE, 1.0, -math.pi, math.pi),
    )
    return replace(performer, **changes)  # type: ignore[arg-type]


def frame_of(layout: MarkerLayout, positions: Array, T_world_head: Array | None = None) -> MarkerFrame:
    return MarkerFrame(5, 1.5, 1.75, layout, positions, np.eye(4) if T_world_head is None else T_world_head)


def opened(performer: Performer, points: Array, angle: float) -> Array:
    assert performer.jaw is not None
    R = geometry.matrix_from_quat(geometry.quat_from_axis_angle(performer.jaw.axis, angle))
    back: Array = (points - performer.jaw.pivot) @ R.T + performer.jaw.pivot
    return back


def assert_at_rest(rig: Rig, pose: Pose) -> None:
    np.testing.assert_allclose(pose.translations, rig.joints.translations, atol=1e-12)
    np.testing.assert_allclose(
        geometry.matrix_from_quat(pose.rotations), geometry.matrix_from_quat(rig.joints.rotations), atol=1e-12
    )


def turned_jaw(rig: Rig, pose: Pose) -> float:
    """Turn of the rig's jaw about its hinge [rad], out of the pose's matrices."""
    assert rig.jaw is not None
    rest, now = rig.joints.T_rig_joint[rig.jaw.joint, :3, :3], joint_transforms(rig, pose)[rig.jaw.joint, :3, :3]
    x, y, z, w = geometry.quat_from_matrix(head_turn(rig, pose).T @ now @ rest.T)
    return 2 * math.atan2(float(np.dot([x, y, z], rig.jaw.axis)), w)


@both_axes
def test_the_neutral_is_the_rest(axes: Axes) -> None:
    rig, layout = small_rig(axes), layout_of(*SITES)
    performer = performer_for(rig, layout)
    pose = JointMapping(rig, layout, performer)(frame_of(layout, performer.neutral))
    assert_at_rest(rig, pose)
    assert (pose.number, pose.time_s, pose.received_s) == (5, 1.5, 1.75)
    np.testing.assert_array_equal(pose.weights, np.zeros(len(rig.shape_names)))


@both_axes
@pytest.mark.parametrize("K", [0.25, [0.25, 0.5, 1.0], [[0.5, 0.1, 0], [0, 0.7, -0.2], [0.3, 0, 1]]])
@pytest.mark.parametrize("site", ["browInnerLeft", "lipLower"])
def test_a_joint_moves_by_K_times_the_displacement_in_head_and_no_other_moves(
    site: str, K: float | list[float] | list[list[float]], axes: Axes
) -> None:
    rig, layout = small_rig(axes), layout_of(*SITES)
    performer = performer_for(rig, layout, K={site: gain_matrix(K)})
    moved = np.array([0.004, -0.003, 0.002])
    positions = performer.neutral.copy()
    positions[SITES.index(site)] += moved
    places = site_places(rig, JointMapping(rig, layout, performer)(frame_of(layout, positions)))
    for name, place in places.items():
        expected = gain_matrix(K) @ moved if name == site else np.zeros(3)
        np.testing.assert_allclose(place - rig.sites[name].rest, expected, atol=1e-12)


@both_axes
@pytest.mark.parametrize("site", ["browInnerLeft", "lipLower"])
def test_a_K_by_direction_takes_each_axis_by_the_side_to_which_it_went(site: str, axes: Axes) -> None:
    rig, layout = small_rig(axes), layout_of(*SITES)
    K = [[0.5, 0.6, 0.7], [0.1, 0.2, 0.3]]
    performer = performer_for(rig, layout, K={site: gain_matrix(K), "mandibleLeft": gain_matrix(0.5)})
    positions = performer.neutral.copy()
    positions[SITES.index(site)] += [0.004, -0.003, 0.002]
    positions[SITES.index("mandibleLeft")] += [-0.002, 0.0, 0.002]
    places = site_places(rig, JointMapping(rig, layout, performer)(frame_of(layout, positions)))
    np.testing.assert_allclose(places[site] - rig.sites[site].rest, [0.002, -0.0006, 0.0014], atol=1e-12)
    moved = places["mandibleLeft"] - rig.sites["mandibleLeft"].rest
    np.testing.assert_allclose(moved, [-0.001, 0.0, 0.001], atol=1e-12)


@both_axes
def test_a_jaw_pushed_forward_reads_as_closing_and_moves_chin_and_lip_instead(axes: Axes) -> None:
    """The rig's jaw cannot close further, so nothing is taken back and all of the way is left to the joints."""
    rig, layout = small_rig(axes), layout_of(*SITES)
    assert rig.jaw is not None
    performer = performer_for(rig, layout)
    assert performer.jaw is not None
    performer = replace(performer, jaw=replace(performer.jaw, min_rad=0.0))
    mapping = JointMapping(rig, layout, performer)
    positions = performer.neutral.copy()
    riders = [SITES.index(site) for site in ("lipLower", "mandibleLeft", "chin")]
    positions[riders] += [0.0, 0.0, 0.006]
    frame = frame_of(layout, positions)
    assert math.degrees(mapping.jaw_angle(frame)) < -1.5
    pose = mapping(frame)
    assert abs(turned_jaw(rig, pose)) < 1e-9
    places = site_places(rig, pose)
    for site in ("lipLower", "mandibleLeft", "chin"):
        np.testing.assert_allclose(places[site] - rig.sites[site].rest, [0.0, 0.0, 0.006 * SCALE], atol=1e-12)


def test_a_site_without_a_K_moves_by_the_size_ratio() -> None:
    rig, layout = small_rig(), layout_of(*SITES)
    performer = performer_for(rig, layout)
    positions = performer.neutral.copy()
    positions[0] += [0.0, 0.01, 0.0]
    places = site_places(rig, JointMapping(rig, layout, performer)(frame_of(layout, positions)))
    np.testing.assert_allclose(places[SITES[0]] - rig.sites[SITES[0]].rest, [0, SCALE * 0.01, 0], atol=1e-12)


@both_axes
def test_what_rides_on_the_jaw_is_moved_once_when_the_jaw_opens(axes: Axes) -> None:
    rig, layout = small_rig(axes), layout_of(*SITES)
    assert rig.jaw is not None
    performer = performer_for(rig, layout)
    riders = [rig.sites[site].rides_jaw for site in SITES]
    positions = np.where(np.array(riders)[:, None], opened(performer, performer.neutral, 0.3), performer.neutral)
    pose = JointMapping(rig, layout, performer)(frame_of(layout, positions))
    np.testing.assert_allclose(pose.translations, rig.joints.translations, atol=1e-12)
    assert turned_jaw(rig, pose) == pytest.approx(0.3)
    places = site_places(rig, pose)
    for site, rides in zip(SITES, riders, strict=True):
        expected = opened(performer, rig.sites[site].rest / SCALE, 0.3) * SCALE if rides else rig.sites[site].rest
        np.testing.assert_allclose(places[site], expected, atol=1e-12)


@pytest.mark.parametrize(
    ("gain", "own_limits", "angle", "turn"),
    [
        (1.0, (-math.pi, math.pi), 0.2, 0.2),
        (0.5, (-math.pi, math.pi), 0.2, 0.1),
        (1.0, (-math.pi, math.pi), 1.2, math.radians(35)),
        (1.0, (-math.pi, math.pi), -0.2, math.radians(-2)),
        (1.0, (-0.01, 0.15), 0.2, 0.15),
        (1.0, (-0.01, 0.15), -0.2, -0.01),
    ],
)
def test_the_jaw_turns_by_its_own_gain_within_the_limits_of_rig_and_performer(
    gain: float, own_limits: tuple[float, float], angle: float, turn: float
) -> None:
    rig, layout = small_rig("turned"), layout_of(*SITES)
    performer = performer_for(rig, layout)
    assert performer.jaw is not None
    jaw = replace(performer.jaw, gain=gain, min_rad=own_limits[0], max_rad=own_limits[1])
    mapping = JointMapping(rig, layout, replace(performer, jaw=jaw))
    frame = frame_of(layout, opened(performer, performer.neutral, angle))
    assert mapping.jaw_angle(frame) == pytest.approx(angle)
    assert turned_jaw(rig, mapping(frame)) == pytest.approx(turn)


def test_a_sideways_slide_of_the_chin_opens_the_jaw_only_by_the_cosine_law() -> None:
    rig, layout = small_rig(), layout_of("chin", "noseTip")
    performer = performer_for(rig, layout)
    assert performer.jaw is not None
    slid = frame_of(layout, performer.neutral + np.array([[0.01, 0, 0], [0, 0, 0]]))
    cosine = replace(performer, jaw=replace(performer.jaw, mode="cosine"))
    signed_angle, cosine_angle = (JointMapping(rig, layout, p).jaw_angle(slid) for p in (performer, cosine))
    assert signed_angle == pytest.approx(0.0, abs=1e-12)
    assert math.degrees(cosine_angle) > 4


@both_axes
def test_markers_that_are_not_seen_leave_their_joints_at_rest(axes: Axes) -> None:
    rig, layout = small_rig(axes), layout_of(*SITES)
    performer = performer_for(rig, layout)
    pose = JointMapping(rig, layout, performer)(frame_of(layout, np.full((len(SITES), 3), np.nan)))
    assert_at_rest(rig, pose)


def test_without_the_chin_the_jaw_rests_and_the_lip_still_arrives_where_its_marker_is() -> None:
    rig, layout = small_rig(), layout_of(*SITES)
    performer = performer_for(rig, layout)
    positions = opened(performer, performer.neutral, 0.2)
    positions[SITES.index("chin")] = np.nan
    mapping = JointMapping(rig, layout, performer)
    pose = mapping(frame_of(layout, positions))
    assert math.isnan(mapping.jaw_angle(frame_of(layout, positions)))
    assert turned_jaw(rig, pose) == 0.0
    np.testing.assert_allclose(site_places(rig, pose)["lipLower"], SCALE * positions[SITES.index("lipLower")])


@given(st.lists(st.sampled_from([0.0, 1.0, math.nan]), min_size=15, max_size=15), st.booleans())
def test_no_pattern_of_missing_numbers_reaches_the_pose(values: list[float], lost_head: bool) -> None:
    rig, layout = small_rig(), layout_of(*SITES)
    performer = performer_for(rig, layout)
    positions = performer.neutral + 0.01 * np.array(values).reshape(5, 3)
    T_world_head = np.full((4, 4), np.nan) if lost_head else np.eye(4)
    pose = JointMapping(rig, layout, performer)(frame_of(layout, positions, T_world_head))
    for array in (pose.translations, pose.rotations, pose.T_world_head, pose.weights):
        assert np.isfinite(array).all()
    np.testing.assert_allclose(np.linalg.norm(pose.rotations, axis=1), 1.0)


def test_several_markers_at_one_site_count_by_the_mean_of_those_seen() -> None:
    rig, layout = small_rig("turned"), layout_of("noseTip", "browInnerLeft", "browInnerLeft")
    performer = performer_for(rig, layout)
    mapping = JointMapping(rig, layout, performer)
    offsets = np.array([[0, 0, 0], [0, 0.01, 0], [0, 0.02, 0.004]])
    for gone, mean in (([], [0, 0.015, 0.002]), ([1], [0, 0.02, 0.004]), ([1, 2], [0, 0, 0])):
        positions = performer.neutral + offsets
        positions[gone] = np.nan
        place = site_places(rig, mapping(frame_of(layout, positions)))["browInnerLeft"]
        np.testing.assert_allclose(place - rig.sites["browInnerLeft"].rest, SCALE * np.array(mean), atol=1e-12)


def test_several_sites_of_one_joint_move_it_by_their_mean() -> None:
    rig, layout = small_rig(), layout_of("browInnerLeft", "browMidLeft")
    sites = rig.sites | {"browMidLeft": replace_joint(rig.sites["browMidLeft"], rig.sites["browInnerLeft"].joint)}
    rig = replace(rig, sites=sites)
    performer = performer_for(rig, layout)
    positions = performer.neutral + np.array([[0, 0.01, 0], [0, 0.03, 0]])
    pose = JointMapping(rig, layout, performer)(frame_of(layout, positions))
    moved = (
        joint_transforms(rig, pose)[sites["browInnerLeft"].joint, :3, 3]
        - (rig.joints.T_rig_joint[sites["browInnerLeft"].joint, :3, 3])
    )
    np.testing.assert_allclose(moved, [0, SCALE * 0.02, 0], atol=1e-12)


def replace_joint(site: Site, joint: int) -> Site:
    return Site(site.name, joint, site.rides_jaw, site.rest)


def test_a_joint_below_another_that_is_driven_is_not_moved_twice() -> None:
    rig, layout = small_rig(), layout_of("browInnerLeft", "browMidLeft")
    inner, mid = (rig.sites[name].joint for name in layout.sites)
    parents, translations = rig.joints.parents.copy(), rig.joints.translations.copy()
    parents[mid] = inner
    translations[mid] -= translations[inner]
    rig = replace(rig, joints=replace(rig.joints, parents=parents, translations=translations))
    performer = performer_for(rig, layout)
    moved = np.array([[0.002, 0.01, 0], [0, 0.03, 0.001]])
    pose = JointMapping(rig, layout, performer)(frame_of(layout, performer.neutral + moved))
    places = site_places(rig, pose)
    for name, offset in zip(layout.sites, moved, strict=True):
        np.testing.assert_allclose(places[name] - rig.sites[name].rest, SCALE * offset, atol=1e-12)


@both_axes
def test_neck_and_head_share_the_turn_of_the_head_since_the_reference(axes: Axes) -> None:
    rig, layout = small_rig(axes), layout_of(*SITES)
    performer = performer_for(rig, layout)
    stance = geometry.quat_from_axis_angle([0, 1, 0], 0.5)
    turn = geometry.quat_from_axis_angle(np.array([2, 3, -1]) / math.sqrt(14), 0.6)
    T_world_reference = geometry.transform(geometry.matrix_from_quat(stance), [1, 2, 3])
    T_world_head = T_world_reference @ geometry.transform(geometry.matrix_from_quat(turn), [0.1, 0, 0.05])
    mapping = JointMapping(rig, layout, performer, T_world_reference)
    pose = mapping(frame_of(layout, performer.neutral, T_world_head))
    np.testing.assert_allclose(head_turn(rig, pose), geometry.matrix_from_quat(turn), atol=1e-12)
    assert rig.neck_joint is not None
    neck = joint_transforms(rig, pose)[rig.neck_joint, :3, :3] @ rig.joints.T_rig_joint[rig.neck_joint, :3, :3].T
    expected = geometry.slerp(geometry.IDENTITY_QUAT, turn, NECK_SHARE)
    np.testing.assert_allclose(neck, geometry.matrix_from_quat(expected), atol=1e-12)
    np.testing.assert_array_equal(pose.T_world_head, T_world_head)
    assert_at_rest(rig, mapping(frame_of(layout, performer.neutral, T_world_reference)))


def test_a_rig_without_a_neck_turns_its_head_alone() -> None:
    rig, layout = replace(small_rig("turned"), neck_joint=None), layout_of(*SITES)
    performer = performer_for(rig, layout)
    R = geometry.matrix_from_quat(geometry.quat_from_axis_angle([0, 1, 0], 0.5))
    pose = JointMapping(rig, layout, performer)(frame_of(layout, performer.neutral, geometry.transform(R, [0, 0, 0])))
    np.testing.assert_allclose(head_turn(rig, pose), R, atol=1e-12)
    np.testing.assert_allclose(pose.rotations[0], rig.joints.rotations[0])


def test_the_face_is_the_same_whichever_way_the_head_looks() -> None:
    rig, layout = small_rig("turned"), layout_of(*SITES)
    performer = performer_for(rig, layout)
    mapping = JointMapping(rig, layout, performer)
    positions = opened(performer, performer.neutral, 0.1) + 0.003
    R = geometry.matrix_from_quat(geometry.quat_from_axis_angle([0, 0, 1], 0.8))
    straight, tilted = (
        site_places(rig, mapping(frame_of(layout, positions, T))) for T in (np.eye(4), geometry.transform(R, [1, 1, 1]))
    )
    for name, place in straight.items():
        np.testing.assert_allclose(tilted[name], place, atol=1e-12)


def test_a_rig_without_a_jaw_is_driven_by_the_markers_alone() -> None:
    rig = small_rig()
    layout = layout_of(*SITES)
    performer = performer_for(rig, layout)
    jawless = replace(rig, jaw=None)
    positions = opened(performer, performer.neutral, 0.2)
    mapping = JointMapping(jawless, layout, performer)
    assert math.isnan(mapping.jaw_angle(frame_of(layout, positions)))
    pose = mapping(frame_of(layout, positions))
    np.testing.assert_array_equal(pose.rotations[2], rig.joints.rotations[2])
    np.testing.assert_allclose(site_places(jawless, pose)["lipLower"], SCALE * positions[SITES.index("lipLower")])


def test_a_marker_on_the_jaw_joint_itself_only_turns_it() -> None:
    rig, layout = small_rig(), layout_of("chin", "noseTip")
    assert rig.jaw is not None
    rig = replace(rig, sites=rig.sites | {"chin": Site("chin", rig.jaw.joint, False, rig.sites["chin"].rest)})
    performer = performer_for(rig, layout)
    mapping = JointMapping(rig, layout, performer)
    pose = mapping(frame_of(layout, opened(performer, performer.neutral, 0.2)))
    assert mapping.sites == ("noseTip",)
    assert turned_jaw(rig, pose) == pytest.approx(0.2)
    np.testing.assert_array_equal(pose.translations[2], rig.joints.translations[2])


def test_where_a_layout_has_no_chin_the_lower_lip_tells_the_jaw() -> None:
    assert JAW_SITES[0][0] == "chin"
    rig, layout = small_rig(), layout_of("lipLowerLeft", "lipLowerRight", "noseTip")
    performer = performer_for(rig, layout)
    frame = frame_of(layout, opened(performer, performer.neutral, 0.2))
    assert JointMapping(rig, layout, performer).jaw_angle(frame) == pytest.approx(0.2)


def test_markers_are_matched_by_name_whatever_their_order() -> None:
    rig, layout = small_rig(), layout_of(*SITES)
    performer = performer_for(rig, layout)
    backwards = replace(performer, markers=performer.markers[::-1], neutral=performer.neutral[::-1])
    frame = frame_of(layout, performer.neutral + np.array([[0.001 * i] * 3 for i in range(5)]))
    a, b = (JointMapping(rig, layout, p)(frame) for p in (performer, backwards))
    np.testing.assert_array_equal(a.translations, b.translations)


def test_a_marker_without_a_neutral_drives_nothing() -> None:
    rig, layout = small_rig(), layout_of(*SITES)
    performer = performer_for(rig, layout)
    neutral = performer.neutral.copy()
    neutral[0] = np.nan
    mapping = JointMapping(rig, layout, replace(performer, neutral=neutral))
    assert set(mapping.sites) == set(SITES[1:])
    assert_at_rest(rig, mapping(frame_of(layout, performer.neutral)))


def test_a_frame_is_solved_the_same_twice_and_the_rig_stays_as_it_was() -> None:
    rig, layout = small_rig(), layout_of(*SITES)
    performer = performer_for(rig, layout)
    mapping = JointMapping(rig, layout, performer)
    frame = frame_of(layout, opened(performer, performer.neutral, 0.2))
    rest = rig.joints.translations.copy()
    before = frame.positions.copy()
    a, b = mapping(frame), mapping(frame)
    np.testing.assert_array_equal(a.translations, b.translations)
    np.testing.assert_array_equal(a.rotations, b.rotations)
    np.testing.assert_array_equal(rig.joints.translations, rest)
    np.testing.assert_array_equal(frame.positions, before)


def test_a_frame_in_world_is_refused() -> None:
    rig, layout = small_rig(), layout_of(*SITES)
    performer = performer_for(rig, layout)
    with pytest.raises(ValueError, match="stabilised"):
        JointMapping(rig, layout, performer)(MarkerFrame(0, 0.0, 0.0, layout, performer.neutral))


def test_a_performer_of_another_rig_is_refused() -> None:
    rig, layout = small_rig(), layout_of(*SITES)
    with pytest.raises(InputError, match="'ana' was calibrated for the rig 'dragon', not for 'small'"):
        JointMapping(rig, layout, replace(performer_for(rig, layout), rig="dragon"))


def test_a_K_for_a_misspelt_site_is_refused_with_the_nearest_one() -> None:
    rig, layout = small_rig(), layout_of(*SITES)
    with pytest.raises(InputError, match="'browInerLeft', no site of this rig; did you mean 'browInnerLeft'"):
        JointMapping(rig, layout, performer_for(rig, layout, K={"browInerLeft": np.eye(3)}))


def test_a_layout_that_drives_nothing_is_refused_with_what_was_seen_and_expected() -> None:
    rig, layout = small_rig(), layout_of("tail", "wing")
    with pytest.raises(InputError, match=r"markers are marker0, marker1; .* sites are forehead, browCenter") as caught:
        JointMapping(rig, layout, performer_for(rig, layout))
    assert "'test'" in str(caught.value)
