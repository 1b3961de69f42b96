"""Joints against a loop over parents."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from retarget.geometry import matrix_from_quat, transform
from retarget.rig.hierarchy import joint_matrices
from tests.rig.tubes import random_joints

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def one_by_one(parents: NDArray[np.intp], translations: Array, rotations: Array) -> Array:
    T = transform(matrix_from_quat(rotations), translations)
    for j, parent in enumerate(parents):
        if parent >= 0:
            T[j] = T[parent] @ T[j]
    return T


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 40))
def test_every_joint_is_its_parents_transform_times_its_own(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    joints = random_joints(rng, count)
    translations, rotations = rng.normal(size=(count, 3)), rng.normal(size=(count, 4))
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    got = joint_matrices(joints, translations, rotations)
    np.testing.assert_allclose(got, one_by_one(joints.parents, translations, rotations), atol=1e-12)


def test_the_rest_pose_gives_the_rest_matrices() -> None:
    joints = random_joints(np.random.default_rng(5), 30)
    got = joint_matrices(joints, joints.translations, joints.rotations)
    np.testing.assert_allclose(got, joints.T_rig_joint, atol=1e-12)


def test_a_lost_joint_reaches_what_hangs_below_it_and_nothing_else() -> None:
    joints = random_joints(np.random.default_rng(6), 30)
    translations = joints.translations.copy()
    translations[3] = np.nan
    lost = np.isnan(joint_matrices(joints, translations, joints.rotations)).any(axis=(1, 2))
    below = np.arange(30) == 3
    for j, parent in enumerate(joints.parents):
        below[j] |= parent >= 0 and below[parent]
    np.testing.assert_array_equal(lost, below)
