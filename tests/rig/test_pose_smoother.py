"""Whole poses smoothed: still faces stiller, blinks kept, and what shapes and joints share is not torn apart."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest

from retarget import geometry
from retarget.rig.load import load_rig
from retarget.rig.pose_smoother import PoseSmoother
from retarget.rig.posing import rest_pose
from retarget.rig.site_shapes import site_shapes
from tests.rig.test_drive import LAYOUTS, drive_of, performance
from tests.synthetic.places import site_places

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from retarget.frames import Pose
    from retarget.rig.model import Rig
    from retarget.rig.pose_smoother import Smoothing

    Array = NDArray[np.float64]

SITES = ("lipCornerLeft", "chin", "browMidLeft")


@cache
def human() -> Rig:
    return load_rig("human")


def smoothed(smoothing: str, make: Callable[[Pose, float], Pose], seconds: float = 2.0) -> list[Pose]:
    smoother = PoseSmoother(human(), SITES, cast("Smoothing", smoothing))
    times = (np.arange(round(60 * seconds)) / 60).tolist()
    return [smoother(make(replace(rest_pose(human()), time_s=t), t)) for t in times]


def weight(name: str, value: float) -> Array:
    weights = np.zeros(len(human().shape_names))
    weights[human().shape_names.index(name)] = value
    return weights


def test_none_hands_the_pose_on() -> None:
    pose = rest_pose(human())
    assert PoseSmoother(human(), SITES, "none")(pose) is pose


@pytest.mark.parametrize(("smoothing", "left"), [("one-euro", 0.4), ("pd", 0.05)])
def test_a_face_at_rest_becomes_stiller_in_weights_joints_and_jaw(smoothing: str, left: float) -> None:
    rng = np.random.default_rng(0)
    jaw = human().jaw
    assert jaw is not None
    raw: list[Pose] = []

    def noisy(pose: Pose, _: float) -> Pose:
        translations, rotations = pose.translations.copy(), pose.rotations.copy()
        translations[human().joints.index("chin")] += rng.normal(scale=0.0003, size=3)
        turn = geometry.quat_from_axis_angle(jaw.axis, rng.normal(0.1, 0.005))
        rotations[jaw.joint] = geometry.quat_multiply(pose.rotations[jaw.joint], turn)
        weights = (weight("mouthSmileLeft", 0.5) + rng.normal(scale=0.02, size=len(pose.weights))).clip(0, 1)
        raw.append(replace(pose, translations=translations, rotations=rotations, weights=weights))
        return raw[-1]

    smooth = smoothed(smoothing, noisy)
    smile, chin = human().shape_names.index("mouthSmileLeft"), human().joints.index("chin")
    before, after = (
        np.array([[p.weights[smile], p.translations[chin, 1], p.rotations[jaw.joint, 0]] for p in poses[30:]])
        for poses in (raw, smooth)
    )
    assert (np.diff(after, 2, axis=0).std(axis=0) < left * np.diff(before, 2, axis=0).std(axis=0)).all()


@pytest.mark.parametrize("smoothing", ["one-euro", "pd"])
def test_a_blink_still_shuts_the_eye(smoothing: str) -> None:
    def blinking(pose: Pose, t: float) -> Pose:
        return replace(pose, weights=weight("eyeBlinkLeft", max(0.0, 1 - abs(t - 1) / 0.075)))

    eye = human().shape_names.index("eyeBlinkLeft")
    path = np.array([pose.weights[eye] for pose in smoothed(smoothing, blinking)])
    assert path.max() > 0.9
    assert path[:50].max() < 0.02
    assert path[-1] < 0.1


def test_pd_without_the_trick_would_lose_as_fast_a_motion_elsewhere() -> None:
    def twitching(pose: Pose, t: float) -> Pose:
        return replace(pose, weights=weight("mouthSmileLeft", max(0.0, 1 - abs(t - 1) / 0.075)))

    smile = human().shape_names.index("mouthSmileLeft")
    assert max(pose.weights[smile] for pose in smoothed("pd", twitching)) < 0.5


def test_joints_that_no_marker_drives_and_the_head_are_left_alone() -> None:
    rng = np.random.default_rng(1)

    def shaking(pose: Pose, _: float) -> Pose:
        rotations = pose.rotations.copy()
        turn = geometry.quat_from_axis_angle([0.0, 1.0, 0.0], rng.normal(scale=0.1))
        rotations[human().head_joint] = geometry.quat_multiply(pose.rotations[human().head_joint], turn)
        heads.append(rotations[human().head_joint])
        return replace(pose, rotations=rotations)

    heads: list[Array] = []
    poses = smoothed("one-euro", shaking, 0.5)
    np.testing.assert_array_equal([pose.rotations[human().head_joint] for pose in poses], heads)


@pytest.mark.parametrize("smoothing", ["pd", "one-euro"])
def test_shapes_and_joints_lag_alike_so_that_together_they_go_where_joints_alone_go(smoothing: str) -> None:
    """The PD mass is linear, so it is exact but for the floor of weights; One-Euro follows the speed of each signal."""
    face, take = performance("all")
    shapes, joints = drive_of(face, "both", smoothing), drive_of(face, "joints", smoothing)
    sites = [site for site in LAYOUTS["all"].sites if site and not face.rig.sites[site].rides_jaw]
    displacements = site_shapes(face.rig, sites).displacements
    apart, way = [], []
    for frame in take.stabilised():
        both, alone = shapes(frame), joints(frame)
        places, expected = site_places(face.rig, both), site_places(face.rig, alone)
        for site, displaced in zip(sites, displacements @ both.weights, strict=True):
            apart.append(np.linalg.norm(places[site] + displaced - expected[site]))
            way.append(np.linalg.norm(expected[site] - face.rig.sites[site].rest))
    limit = 0.1 if smoothing == "pd" else 0.2
    assert np.sqrt(np.mean(np.square(apart))) < limit * np.sqrt(np.mean(np.square(way)))
