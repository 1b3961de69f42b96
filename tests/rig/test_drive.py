"""The three ways to drive a face, on the shipped rig and performers of whom everything is known."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest

from retarget import geometry
from retarget.errors import InputError
from retarget.filters import PdGains
from retarget.frames import MarkerFrame
from retarget.performer import gain_matrix
from retarget.rig.drive import Drive
from retarget.rig.joints import JointMapping
from retarget.rig.load import load_rig
from retarget.rig.site_shapes import site_shapes
from retarget.rig.skinning import Skin
from tests.synthetic.capture import captured, with_noise
from tests.synthetic.face import ALL_SITES, FACE24_SITES, face_layout, make_face
from tests.synthetic.motion import everything
from tests.synthetic.places import site_places
from tests.synthetic.rig import small_rig

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerLayout, Pose
    from retarget.rig.drive import DriveMode
    from retarget.rig.model import Jaw, Rig
    from retarget.rig.pose_smoother import Smoothing
    from tests.synthetic.capture import SyntheticTake
    from tests.synthetic.face import SyntheticFace

    Array = NDArray[np.float64]

LAYOUTS = {"face24": face_layout(), "all": face_layout("all", ALL_SITES)}


@cache
def human() -> Rig:
    return load_rig("human")


@cache
def performance(layout: str, seed: int = 1) -> tuple[SyntheticFace, SyntheticTake]:
    rng = np.random.default_rng(seed)
    face = make_face(human(), LAYOUTS[layout], rng)
    return face, captured(face, everything(face.rig, np.arange(60) / 60, rng))


def hinge() -> Jaw:
    jaw = human().jaw
    assert jaw is not None
    return jaw


def plain_face(layout: MarkerLayout) -> SyntheticFace:
    """A performer of the rig's own size whom no K changes, so that rig displacements are marker displacements."""
    face = make_face(human(), layout, np.random.default_rng(0))
    assert face.performer.jaw is not None
    rest = [human().sites[s].rest if s else n for s, n in zip(layout.sites, face.performer.neutral, strict=True)]
    performer = replace(
        face.performer,
        scale=1.0,
        neutral=np.array(rest),
        K={site: gain_matrix(1.0) for site in face.performer.K},
        jaw=replace(face.performer.jaw, axis=hinge().axis, pivot=hinge().pivot, gain=1.0),
    )
    return replace(face, performer=performer)


def frames_of(face: SyntheticFace, weights: Array, rate_hz: float = 60.0) -> list[MarkerFrame]:
    """Markers that the rig's own shapes move, at `weights` (T, B)."""
    layout = face.layout
    driven = [i for i, site in enumerate(layout.sites) if site]
    shapes = site_shapes(face.rig, tuple(layout.sites[i] for i in driven))
    frames = []
    for i, w in enumerate(weights):
        positions = face.performer.neutral.copy()
        positions[driven] += shapes.displacements @ w
        frames.append(MarkerFrame(i, i / rate_hz, i / rate_hz, layout, positions, np.eye(4)))
    return frames


def weights_of(**named: float) -> Array:
    weights = np.zeros(len(human().shape_names))
    for name, value in named.items():
        weights[human().shape_names.index(name)] = value
    return weights


def drive_of(face: SyntheticFace, mode: str, smooth: str = "none") -> Drive:
    return Drive(face.rig, face.layout, face.performer, mode=cast("DriveMode", mode), smooth=cast("Smoothing", smooth))


def skin_at_sites(pose: Pose) -> Array:
    """(41, 3) [m]: the vertex nearest to each site, as it is drawn."""
    rig = human()
    vertices = rig.surfaces[0].positions
    places = [rig.joints.T_rig_joint[site.joint, :3, 3] for site in rig.sites.values()]
    nearest = [int(np.argmin(np.linalg.norm(vertices - p, axis=1))) for p in places]
    return np.asarray(skin().positions(pose)[nearest], float)


@cache
def skin() -> Skin:
    return Skin(human())


def test_joints_alone_are_the_joint_mapping() -> None:
    face, take = performance("all")
    drive, mapping = drive_of(face, "joints"), JointMapping(face.rig, face.layout, face.performer)
    for frame in take.stabilised():
        ours, plain = drive(frame), mapping(frame)
        np.testing.assert_array_equal(ours.translations, plain.translations)
        np.testing.assert_array_equal(ours.rotations, plain.rotations)
        assert not ours.weights.any()


@pytest.mark.parametrize("layout", LAYOUTS)
def test_with_shapes_known_weights_come_back_and_joints_rest(layout: str) -> None:
    face = plain_face(LAYOUTS[layout])
    drive = drive_of(face, "shapes")
    truth = weights_of(mouthSmileLeft=0.7, browInnerUp=0.5, mouthPucker=0.2)
    still = [truth] * 40
    pose = [drive(frame) for frame in frames_of(face, np.array(still))][-1]
    np.testing.assert_allclose(pose.weights, truth, atol=0.06)
    np.testing.assert_array_equal(pose.translations, human().joints.translations)
    np.testing.assert_array_equal(pose.rotations[2:], human().joints.rotations[2:])


def test_with_shapes_jaw_open_opens_the_mouth_and_the_jaws_joint_rests() -> None:
    face = plain_face(LAYOUTS["all"])
    truth = weights_of(jawOpen=0.6)
    drive = drive_of(face, "shapes")
    pose = [drive(frame) for frame in frames_of(face, np.array([truth] * 20))][-1]
    opened = pose.weights[human().shape_names.index("jawOpen")]
    assert opened == pytest.approx(0.6, abs=0.08)
    jaw = hinge().joint
    np.testing.assert_array_equal(pose.rotations[jaw], human().joints.rotations[jaw])


def test_with_both_the_jaws_joint_opens_the_mouth_and_jaw_open_stays_0() -> None:
    face, take = performance("all")
    drive = drive_of(face, "both")
    jaw, shape = hinge().joint, human().shape_names.index("jawOpen")
    turned = []
    for frame in take.stabilised():
        pose = drive(frame)
        assert pose.weights[shape] == 0
        turned.append(2 * np.arccos(min(1.0, abs(pose.rotations[jaw] @ human().joints.rotations[jaw]))))
    np.testing.assert_allclose(turned, take.rig_jaw_rad, atol=1e-3)
    assert max(turned) > 0.1


@pytest.mark.parametrize("layout", LAYOUTS)
def test_with_both_joints_and_shapes_together_put_each_site_where_joints_alone_put_it(layout: str) -> None:
    """The joint's place plus what the weights do to the skin there, carried by the jaw, is the joint mapping's."""
    face, take = performance(layout)
    drive, mapping = drive_of(face, "both"), JointMapping(face.rig, face.layout, face.performer)
    shapes = site_shapes(face.rig, mapping.sites)
    for frame, angle in zip(take.stabilised(), take.rig_jaw_rad, strict=True):
        pose = drive(frame)
        together, alone = site_places(face.rig, pose), site_places(face.rig, mapping(frame))
        turn = geometry.matrix_from_quat(geometry.quat_from_axis_angle(hinge().axis, angle))
        for s, site in enumerate(mapping.sites):
            morph = shapes.displacements[s] @ pose.weights
            morph = turn @ morph if face.rig.sites[site].rides_jaw else morph
            np.testing.assert_allclose(together[site] + morph, alone[site], atol=2e-4)
        assert np.count_nonzero(pose.weights) > 2


def test_with_both_no_motion_is_applied_twice_to_the_skin_that_is_drawn() -> None:
    """A smile that the shapes explain: in "both" the drawn skin is near where the shapes alone bring it."""
    face = plain_face(LAYOUTS["all"])
    frames = frames_of(face, np.array([weights_of(mouthSmileLeft=0.8, mouthSmileRight=0.8)] * 30))
    drives = {mode: drive_of(face, mode) for mode in ("shapes", "both")}
    poses = {mode: [drive(frame) for frame in frames][-1] for mode, drive in drives.items()}
    rest = skin_at_sites(replace(poses["shapes"], weights=np.zeros(len(human().shape_names))))
    way = {mode: np.linalg.norm(skin_at_sites(pose) - rest, axis=1) for mode, pose in poses.items()}
    corner = list(human().sites).index("lipCornerLeft")
    assert way["shapes"][corner] > 0.005
    assert way["both"][corner] == pytest.approx(way["shapes"][corner], rel=0.1)


def test_a_rig_without_jaw_open_turns_its_jaw_with_shapes_too() -> None:
    face, take = performance("all")
    renamed = tuple("mandibleDown" if name == "jawOpen" else name for name in human().shape_names)
    rig = replace(human(), shape_names=renamed)
    assert rig.jaw is not None
    drive = Drive(rig, face.layout, face.performer, mode="shapes")
    poses = [drive(frame) for frame in take.stabilised()]
    assert max(np.abs(p.rotations[rig.jaw.joint] - rig.joints.rotations[rig.jaw.joint]).max() for p in poses) > 0.05


def test_markers_that_were_filled_and_not_seen_do_not_ask_for_weights() -> None:
    face = plain_face(LAYOUTS["all"])
    truth = weights_of(mouthSmileLeft=0.7)
    frames = frames_of(face, np.array([truth] * 30))
    corner = face.layout.names.index("lipCornerLeft")
    believing, asking = drive_of(face, "shapes"), drive_of(face, "shapes")
    seen = np.ones(len(face.layout.names), bool)
    seen[corner] = False
    for frame in frames:
        positions = frame.positions.copy()
        positions[corner] = face.performer.neutral[corner]  # what a filler may hold
        filled = replace(frame, positions=positions)
        misled, told = believing(filled), asking(filled, seen)
    np.testing.assert_allclose(told.weights, truth, atol=0.08)
    assert np.abs(misled.weights - truth).max() > 0.15


@pytest.mark.parametrize("mode", ["joints", "shapes", "both"])
@pytest.mark.parametrize("smooth", ["none", "pd", "one-euro"])
def test_poses_are_finite_in_range_and_the_same_for_the_same_frames(mode: str, smooth: str) -> None:
    face, take = performance("face24")
    noisy = with_noise(take, np.random.default_rng(0), 0.001)
    frames = [*noisy.stabilised()]
    lost = replace(
        frames[30], positions=np.full_like(frames[30].positions, np.nan), T_world_head=np.full((4, 4), np.nan)
    )
    frames[30] = lost
    first, second = drive_of(face, mode, smooth), drive_of(face, mode, smooth)
    for frame in frames:
        pose, again = first(frame), second(frame)
        for name in ("translations", "rotations", "weights", "T_world_head"):
            np.testing.assert_array_equal(getattr(pose, name), getattr(again, name))
            assert np.isfinite(getattr(pose, name)).all()
        assert pose.weights.min() >= 0
        assert pose.weights.max() <= 1
        np.testing.assert_allclose(np.linalg.norm(pose.rotations, axis=1), 1.0)


def test_a_take_that_begins_again_is_driven_as_the_first_time() -> None:
    face, take = performance("face24")
    drive = drive_of(face, "both", "one-euro")
    frames = [replace(frame, time_s=3 * frame.time_s) for frame in take.stabilised()]
    first = [drive(frame).weights for frame in frames]
    again = [drive(frame).weights for frame in frames]
    np.testing.assert_array_equal(first, again)


def test_joints_marked_secondary_trail_after_the_head() -> None:
    face, take = performance("face24")
    trailing = human().joints.index("eyeLeft")  # an eye hangs from nothing, but it carries vertices
    rig = replace(human(), secondary={trailing: PdGains()})
    drive, rigid = Drive(rig, face.layout, face.performer), Drive(human(), face.layout, face.performer)
    apart = [np.abs(drive(f).rotations[trailing] - rigid(f).rotations[trailing]).max() for f in take.stabilised()]
    assert apart[0] < 1e-9
    assert max(apart) > 0.005


def test_shapes_are_told_apart_into_driven_and_frozen() -> None:
    drive = drive_of(performance("face24")[0], "both")
    assert "jawOpen" not in drive.driven_shapes + drive.frozen_shapes
    assert {"browInnerUp", "mouthSmileLeft"} <= set(drive.driven_shapes)
    assert {"tongueOut", "eyeBlinkLeft"} <= set(drive.frozen_shapes)
    assert not drive_of(performance("face24")[0], "joints").driven_shapes


def test_what_there_is_not_is_refused_with_what_there_is() -> None:
    face, _ = performance("face24")
    with pytest.raises(InputError, match=r"bones.*joints, shapes, both"):
        drive_of(face, "bones")
    with pytest.raises(InputError, match=r"soft.*pd, one-euro, none"):
        drive_of(face, "joints", "soft")


def test_shapes_on_a_rig_without_any_are_refused_and_joints_are_not() -> None:
    rng = np.random.default_rng(0)
    face = make_face(small_rig(), face_layout("face24", FACE24_SITES), rng)
    drive_of(face, "joints")
    with pytest.raises(InputError, match="drive its joints"):
        drive_of(face, "shapes")
