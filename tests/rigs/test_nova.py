"""The stylised rig as shipped, read with pygltflib: same joints, sites and shapes as the default one, another face."""

from __future__ import annotations

import hashlib
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.rigs.glb import Model, Surface, read

RIGS = Path(__file__).parents[2] / "rigs"
FOLDER = RIGS / "nova"
GLB = FOLDER / "nova.glb"
MEGABYTE = 1_000_000


@pytest.fixture(scope="module")
def rig() -> dict[str, Any]:
    return tomllib.loads((FOLDER / "rig.toml").read_text())


@pytest.fixture(scope="module")
def nova() -> Model:
    return read(GLB)


@pytest.fixture(scope="module")
def human() -> Model:
    return read(RIGS / "human" / "human.glb")


def shift(model: Model, surface: Surface, shape: str) -> float:
    """The largest distance [m] that a vertex goes."""
    return float(np.linalg.norm(surface.targets[model.shape_names.index(shape)], axis=1).max())


def eye_radius(model: Model) -> float:
    eyes = model.surfaces["eyes"]
    ball = eyes.positions[eyes.weights_of({model.joints.index("eyeLeft")}) == 1]
    return float(np.median(np.linalg.norm(ball - model.places["eyeLeft"], axis=1)))


def test_the_file_is_the_one_that_rig_toml_names_and_small(rig: dict[str, Any]) -> None:
    assert rig["mesh"] == GLB.name
    assert hashlib.sha256(GLB.read_bytes()).hexdigest() == rig["licence"]["sha256"]
    assert GLB.stat().st_size < 3 * MEGABYTE


def test_the_licence_is_there_and_says_cc0(rig: dict[str, Any]) -> None:
    text = (FOLDER / rig["licence"]["file"]).read_text()
    for part in ("CC0 1.0 Universal", "MakeHuman", "Suominen", '"nova"'):
        assert part in text


def test_joints_sites_and_shapes_are_those_of_the_default_rig(rig: dict[str, Any], nova: Model, human: Model) -> None:
    other = tomllib.loads((RIGS / "human" / "rig.toml").read_text())
    assert rig["sites"] == other["sites"]
    assert rig["joints"] == other["joints"]
    assert nova.joints == human.joints
    assert nova.parents == human.parents
    assert nova.shape_names == human.shape_names
    assert len(nova.shape_names) == 52


def test_every_site_joint_lies_on_the_skin(rig: dict[str, Any], nova: Model) -> None:
    skin = nova.surfaces["skin"]
    for joint in rig["sites"].values():
        assert np.linalg.norm(skin.positions - nova.places[joint], axis=1).min() < 1e-5


def test_the_eyes_are_a_third_larger_and_in_their_joints(nova: Model, human: Model) -> None:
    assert eye_radius(nova) > 1.3 * eye_radius(human)


def test_the_face_is_another_one(rig: dict[str, Any], nova: Model, human: Model) -> None:
    sites = list(rig["sites"].values())
    one, two = (np.array([m.places[s] - m.places["noseBridge"] for s in sites]) for m in (nova, human))
    one, two = (x - x.mean(0) for x in (one, two))
    apart = np.linalg.norm(one / np.linalg.norm(one) - two / np.linalg.norm(two))
    assert apart > 0.05  # sizes aside


def test_every_shape_moves_the_face_visibly(nova: Model) -> None:
    for shape in nova.shape_names:
        assert max(shift(nova, surface, shape) for surface in nova.surfaces.values()) > 0.0015, shape


def lid_gap_left_by_a_blink(model: Model) -> float:
    """The height between the markers on the lids, shut over open."""
    skin, blink = model.surfaces["skin"], model.shape_names.index("eyeBlinkLeft")
    vertices = [
        int(np.argmin(np.linalg.norm(skin.positions - model.places[lid], axis=1)))
        for lid in ("lidUpperLeft", "lidLowerLeft")
    ]
    upper, lower = skin.positions[vertices, 1]
    upper_shut, lower_shut = (skin.positions + skin.targets[blink])[vertices, 1]
    return float((upper_shut - lower_shut) / (upper - lower))


def test_a_blink_shuts_the_large_eye_as_far_as_the_default_one(nova: Model, human: Model) -> None:
    assert lid_gap_left_by_a_blink(nova) < lid_gap_left_by_a_blink(human) + 0.05


def test_the_hair_follows_the_head_and_hides_no_site(rig: dict[str, Any], nova: Model) -> None:
    hair = nova.surfaces["hair"]
    np.testing.assert_array_equal(hair.weights_of({nova.joints.index("head")}), 1)
    for joint in rig["sites"].values():
        in_front = hair.positions[:, 2] > nova.places[joint][2]
        near = np.linalg.norm((hair.positions - nova.places[joint])[:, :2], axis=1) < 0.006
        assert not (in_front & near).any(), joint
