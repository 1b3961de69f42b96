"""The whole way from markers to poses: on real takes, and on a performer whose truth is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from retarget.errors import InputError
from retarget.frames import MarkerFrame, MarkerLayout
from retarget.markers.c3d import read_c3d
from retarget.markers.layouts import load_layout
from retarget.rig.hierarchy import joint_matrices
from retarget.session import Session, neutral_in, poses
from tests.synthetic.capture import captured
from tests.synthetic.demo_take import demo_take
from tests.synthetic.face import face_layout, make_face
from tests.synthetic.motion import everything
from tests.synthetic.rig import small_rig

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import Pose
    from retarget.markers.clip import MarkerClip
    from retarget.rig.model import Rig

    Array = NDArray[np.float64]

ANIMFACE = Path(__file__).parents[1] / "../shared/data/animface"
REST = slice(0, 30)


def real_take(name: str) -> MarkerClip:
    path = ANIMFACE / f"{name}.c3d"
    if not path.exists():
        pytest.skip(f"the real recording {name}.c3d is not beside the project")
    return read_c3d(path)


def solved(clip: MarkerClip, rig: Rig) -> tuple[list[Pose], Session]:
    session = Session(rig)
    return list(poses(clip, session)), session


def jaw_deg(rig: Rig, solution: list[Pose]) -> Array:
    assert rig.jaw is not None
    turns = Rotation.from_quat([pose.rotations[rig.jaw.joint] for pose in solution])
    return np.degrees(turns.as_rotvec() @ rig.jaw.axis)


def without_head_motion(clip: MarkerClip) -> Array:
    """By scipy alone, from the markers that hardly move on a face."""
    stable = (
        "ForeHead_M",
        "ForeHead_L",
        "ForeHead_R",
        "NoseTop",
        "Leye_Inside",
        "Reye_Inside",
        "Leye_Outside",
        "Reye_Outside",
    )
    index = [clip.layout.names.index(name) for name in stable]
    template = clip.positions[REST][:, index].mean(axis=0)
    still = np.empty_like(clip.positions)
    for i, frame in enumerate(clip.positions):
        centre = frame[index].mean(axis=0)
        turn, _ = Rotation.align_vectors(template - template.mean(axis=0), frame[index] - centre)
        still[i] = turn.apply(frame - centre) + template.mean(axis=0)
    return still


def test_the_jaw_of_a_real_take_follows_the_chin() -> None:
    clip, rig = real_take("jaw"), small_rig()
    angle = jaw_deg(rig, solved(clip, rig)[0])
    chin = without_head_motion(clip)[:, clip.layout.names.index("Chin")]
    distance = np.linalg.norm(chin - chin[REST].mean(axis=0), axis=1)
    assert np.corrcoef(angle[300:500], distance[300:500])[0, 1] > 0.98
    assert abs(angle[5]) < 1.0
    assert angle[420] > 15.0


def test_raised_brows_leave_the_mouth_alone() -> None:
    rig = small_rig()
    solution, _ = solved(real_take("eyebrows"), rig)
    rise = np.array([pose.translations for pose in solution]) - rig.joints.translations
    height = {site: rise[:, rig.sites[site].joint, 1] for site in rig.sites}
    assert height["browMidLeft"].max() > 0.005
    assert height["browMidRight"].max() > 0.005
    assert np.abs(jaw_deg(rig, solution)).max() < 2.5
    for site in ("lipLower", "lipCornerLeft", "lipCornerRight", "chin"):
        assert np.sqrt(np.mean(height[site] ** 2)) < 0.001, site


def test_a_known_performer_is_solved_to_a_tenth_of_a_millimetre() -> None:
    rig, rng = small_rig(), np.random.default_rng(5)
    face = make_face(rig, face_layout(), rng)
    take = captured(face, everything(rig, np.arange(400) / 120, rng))
    layout = load_layout("face24")
    solution = list(poses(take.frames(), Session(rig, face.performer, layout)))
    assert len(solution) == 400
    T = np.array([joint_matrices(rig.joints, pose.translations, pose.rotations) for pose in solution])
    T_head_joint = np.linalg.inv(T[:, rig.head_joint])[:, None] @ T
    driven = [site for site in face.layout.sites if site]
    errors = [np.abs(T_head_joint[:, rig.sites[s].joint, :3, 3] - take.joints[s]).max() for s in driven]
    assert max(errors) < 1e-4
    assert np.abs(jaw_deg(rig, solution) - np.degrees(take.rig_jaw_rad)).max() < 0.1


def test_frames_before_the_neutral_is_found_are_solved_later() -> None:
    take = demo_take()
    session = Session(small_rig(), layout=load_layout("face24"))
    counts = [len(session(frame)) for frame in take.frames()]
    assert counts[0] == 0
    assert max(counts) >= 30
    assert sum(counts) == len(take.times)


def test_a_stream_that_never_rests_is_solved_at_its_end() -> None:
    rig, rng = small_rig(), np.random.default_rng(2)
    face = make_face(rig, face_layout(), rng)
    take = captured(face, everything(rig, np.arange(200) / 120, rng))
    session = Session(rig, layout=load_layout("face24"))
    assert [pose.number for pose in poses(take.frames(), session)] == list(range(200))


def test_the_same_frames_give_the_same_poses_to_the_bit() -> None:
    take = demo_take()
    first, second = (list(poses(take.frames(), Session(small_rig(), layout=load_layout("face24")))) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        assert a.translations.tobytes() == b.translations.tobytes()
        assert a.rotations.tobytes() == b.rotations.tobytes()


def test_dropouts_never_make_a_pose_that_is_not_finite_or_jumps() -> None:
    rng = np.random.default_rng(8)
    take = demo_take()
    holes = take.p_world.copy()
    holes[200:260, rng.permutation(24)[:10]] = np.nan
    holes[500:700] = np.nan
    solution = list(poses(replace(take, p_world=holes).frames(), Session(small_rig(), layout=load_layout("face24"))))
    places = np.array([pose.translations for pose in solution])
    assert np.isfinite(places).all()
    assert np.abs(np.diff(places, axis=0)).max() < 0.004


def test_markers_that_no_layout_knows_are_named() -> None:
    frame = MarkerFrame(0, 0.0, 0.0, MarkerLayout("body", ("LKNE", "RKNE")), np.zeros((2, 3)))
    with pytest.raises(InputError, match=r"LKNE, RKNE.*chin"):
        Session(small_rig())(frame)


def test_a_performer_of_another_layout_is_refused() -> None:
    face = make_face(small_rig(), face_layout(), np.random.default_rng(1))
    with pytest.raises(InputError, match="calibrate again"):
        neutral_in(MarkerLayout("other", ("a", "b")), face.performer)
