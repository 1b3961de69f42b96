"""The default rig as shipped, read with pygltflib: what is promised of its joints, weights, shapes and surface."""

from __future__ import annotations

import hashlib
import struct
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import csgraph

from tests.rigs.glb import Model, Surface, read

if TYPE_CHECKING:
    from numpy.typing import NDArray

FOLDER = Path(__file__).parents[2] / "rigs" / "human"
GLB = FOLDER / "human.glb"
MEGABYTE = 1_000_000

MIDDLE_SITES = ("forehead", "browCenter", "noseBridge", "noseTip", "lipUpper", "lipLower", "chin")
PAIRED_SITES = (
    "forehead",
    "browInner",
    "browMid",
    "browOuter",
    "noseWing",
    "lidUpper",
    "lidLower",
    "eyeInner",
    "eyeOuter",
    "cheekUpper",
    "cheekLower",
    "cheekOuter",
    "lipUpper",
    "lipCorner",
    "lipLower",
    "chin",
    "mandible",
)
SITES = {*MIDDLE_SITES, *(f"{name}{side}" for name in PAIRED_SITES for side in ("Left", "Right"))}
JAW_RIDERS = {s for s in SITES if s.startswith(("lipLower", "chin", "mandible"))}
PAIRED_SHAPES = (
    "eyeBlink",
    "eyeLookDown",
    "eyeLookIn",
    "eyeLookOut",
    "eyeLookUp",
    "eyeSquint",
    "eyeWide",
    "mouthSmile",
    "mouthFrown",
    "mouthDimple",
    "mouthStretch",
    "mouthPress",
    "mouthLowerDown",
    "mouthUpperUp",
    "browDown",
    "browOuterUp",
    "cheekSquint",
    "noseSneer",
)
MIDDLE_SHAPES = (
    "jawForward",
    "jawLeft",
    "jawRight",
    "jawOpen",
    "mouthClose",
    "mouthFunnel",
    "mouthPucker",
    "mouthLeft",
    "mouthRight",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    "browInnerUp",
    "cheekPuff",
    "tongueOut",
)
ARKIT = {*MIDDLE_SHAPES, *(f"{name}{side}" for name in PAIRED_SHAPES for side in ("Left", "Right"))}


@pytest.fixture(scope="module")
def rig() -> dict[str, Any]:
    return tomllib.loads((FOLDER / "rig.toml").read_text())


@pytest.fixture(scope="module")
def model() -> Model:
    return read(GLB)


@pytest.fixture(scope="module")
def skin(model: Model) -> Surface:
    return model.surfaces["skin"]


def numbers(model: Model, names: set[str]) -> set[int]:
    return {model.joints.index(name) for name in names}


def welded(surface: Surface) -> NDArray[Any]:
    """(F, 3) triangles over the distinct positions; vertices are split at the seams of the texture."""
    _, index = np.unique(surface.positions, axis=0, return_inverse=True)
    triangles = index.ravel()[surface.triangles]
    a, b, c = triangles.T
    return np.asarray(triangles[(a != b) & (b != c) & (c != a)])


def surface_distance(surface: Surface, place: NDArray[Any]) -> NDArray[Any]:
    """(V,) shortest way along edges from the vertex at `place`."""
    unique, index = np.unique(surface.positions, axis=0, return_inverse=True)
    triangles = index.ravel()[surface.triangles]
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    length = np.linalg.norm(unique[edges[:, 0]] - unique[edges[:, 1]], axis=1) + 1e-9
    graph = sparse.csr_array((length, (edges[:, 0], edges[:, 1])), shape=(len(unique),) * 2)
    start = np.array([np.argmin(np.linalg.norm(unique - place, axis=1))])
    return np.asarray(csgraph.dijkstra(graph, directed=False, indices=start)[0, index.ravel()])


def posed(
    model: Model, surface: Surface, jaw_rad: float = 0.0, moved: dict[str, NDArray[Any]] | None = None
) -> NDArray[Any]:
    """(V, 3): the jaw turned about the character's left, joints moved by metres in the rig's axes; naive skinning."""
    moves = moved or {}
    c, s = np.cos(jaw_rad), np.sin(jaw_rad)
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    pivot = model.places["jaw"]
    out = np.zeros(surface.positions.shape)
    for number, name in enumerate(model.joints):
        rides = name == "jaw" or model.parents[name] == "jaw"
        at = (surface.positions - pivot) @ turn.T + pivot if rides else surface.positions.astype(float)
        out += surface.weights_of({number})[:, None] * (at + moves.get(name, np.zeros(3)))
    return out


def test_the_file_is_the_one_that_rig_toml_names(rig: dict[str, Any]) -> None:
    assert rig["mesh"] == GLB.name
    assert hashlib.sha256(GLB.read_bytes()).hexdigest() == rig["licence"]["sha256"]


def test_the_file_is_a_glb_smaller_than_three_megabytes() -> None:
    data = GLB.read_bytes()
    assert struct.unpack_from("<4sII", data) == (b"glTF", 2, len(data))
    assert len(data) < 3 * MEGABYTE


def test_the_licence_is_there_and_says_cc0(rig: dict[str, Any]) -> None:
    text = (FOLDER / rig["licence"]["file"]).read_text()
    assert "CC0 1.0 Universal" in text
    assert "MakeHuman" in text
    assert "Suominen" in text


def test_every_site_has_a_joint_below_the_head_or_the_jaw(rig: dict[str, Any], model: Model) -> None:
    assert set(rig["sites"]) == SITES
    assert len(SITES) == 41
    for joint in rig["sites"].values():
        assert model.parents[joint] == ("jaw" if joint in JAW_RIDERS else "head")


def test_the_skeleton_is_neck_head_then_jaw_and_eyes(rig: dict[str, Any], model: Model) -> None:
    assert model.parents[rig["joints"]["neck"]] is None
    assert model.parents[rig["joints"]["head"]] == rig["joints"]["neck"]
    for joint in (rig["jaw"]["joint"], rig["joints"]["eye_left"], rig["joints"]["eye_right"]):
        assert model.parents[joint] == rig["joints"]["head"]


def test_the_character_faces_forwards_with_its_left_at_plus_x(model: Model) -> None:
    assert model.places["noseTip"][2] > model.places["head"][2] + 0.05
    assert model.places["forehead"][1] > model.places["chin"][1] + 0.08
    for name in (f"{base}Left" for base in PAIRED_SITES):
        left, right = model.places[name], model.places[name.replace("Left", "Right")]
        np.testing.assert_allclose(left * [-1, 1, 1], right, atol=2e-4)
        assert left[0] > 0.005


def test_inverse_bind_matrices_undo_the_rest_pose(model: Model) -> None:
    for name, matrix in zip(model.joints, model.inverse_bind, strict=True):
        np.testing.assert_allclose(matrix @ [*model.places[name], 1], [0, 0, 0, 1], atol=1e-6)


def test_every_site_joint_lies_on_the_skin_and_takes_it_along(model: Model, skin: Surface) -> None:
    for site in sorted(SITES):
        distance = np.linalg.norm(skin.positions - model.places[site], axis=1)
        nearest = int(np.argmin(distance))
        assert distance[nearest] < 1e-5
        assert skin.weights_of(numbers(model, {site}))[nearest] > 0.95, site


def test_the_eye_joints_lie_in_the_middle_of_the_eyeballs(model: Model) -> None:
    eyes = model.surfaces["eyes"]
    for name in ("eyeLeft", "eyeRight"):
        ball = eyes.positions[eyes.weights_of(numbers(model, {name})) == 1]
        radius = np.linalg.norm(ball - model.places[name], axis=1)
        assert 0.011 < radius.min() < radius.max() < 0.016
        assert np.ptp(radius) < 0.001


def test_weights_are_normalised_and_name_existing_joints(model: Model) -> None:
    for surface in model.surfaces.values():
        np.testing.assert_allclose(surface.weights.sum(1), 1, atol=1e-6)
        assert (surface.weights >= 0).all()
        assert surface.joints.max() < len(model.joints)


def test_the_upper_lip_never_follows_the_lower_one(model: Model, skin: Surface) -> None:
    upper, lower = (
        np.min([surface_distance(skin, model.places[f"{lip}{side}"]) for side in ("", "Left", "Right")], axis=0) < 0.010
        for lip in ("lipUpper", "lipLower")
    )
    assert upper.sum() > 60
    assert lower.sum() > 60
    assert skin.weights_of(numbers(model, JAW_RIDERS | {"jaw"}))[upper].max() == 0
    others = {"head", "neck"} | {s for s in SITES if s.startswith(("lipUpper", "nose"))}
    assert skin.weights_of(numbers(model, others))[lower].max() == 0


def test_a_turn_of_the_jaw_opens_the_mouth_and_leaves_the_upper_face(model: Model, skin: Surface) -> None:
    moved = posed(model, skin, jaw_rad=np.radians(28)) - skin.positions
    upper = surface_distance(skin, model.places["lipUpper"]) < 0.008
    lower = surface_distance(skin, model.places["lipLower"]) < 0.008
    assert np.abs(moved[upper]).max() < 1e-7
    assert moved[lower, 1].max() < -0.020
    above = skin.positions[:, 1] > model.places["noseTip"][1]
    outside = surface_distance(skin, model.places["noseTip"]) < 0.08
    assert np.abs(moved[above & outside]).max() < 0.001


def test_teeth_belong_to_skull_and_jaw_and_the_tongue_to_the_jaw(model: Model) -> None:
    mouth = model.surfaces["mouth"]
    with_head, with_jaw = (mouth.weights_of(numbers(model, {name})) == 1 for name in ("head", "jaw"))
    assert (with_head | with_jaw).all()
    assert mouth.positions[with_head, 1].min() > mouth.positions[with_jaw, 1].min()
    assert with_head.sum() > 100
    assert with_jaw.sum() > 300


def test_teeth_and_tongue_stay_behind_the_shut_lips(model: Model, skin: Surface) -> None:
    mouth = model.surfaces["mouth"]
    lips = min(model.places["lipUpper"][2], model.places["lipLower"][2])
    assert mouth.positions[:, 2].max() < lips - 0.004
    assert skin.positions[:, 2].max() > mouth.positions[:, 2].max()


def test_a_raised_brow_moves_the_brow_and_leaves_the_mouth(model: Model, skin: Surface) -> None:
    brows = {name: np.array([0, 0.009, 0]) for name in SITES if name.startswith("brow")}
    moved = np.linalg.norm(posed(model, skin, moved=brows) - skin.positions, axis=1)
    assert moved[surface_distance(skin, model.places["browMidLeft"]) < 0.004].min() > 0.007
    assert moved[skin.positions[:, 1] < model.places["noseTip"][1]].max() < 1e-7


def test_the_skin_stays_smooth_when_a_joint_moves(model: Model, skin: Surface) -> None:
    """No spike: along an edge the displacement of a 12 mm smile changes by at most 1.5 of its length and 0.8 mm."""
    corner = np.array([0.007, 0.008, -0.006])
    moved = posed(model, skin, moved={"lipCornerLeft": corner, "lipCornerRight": corner * [-1, 1, 1]}) - skin.positions
    edges = np.concatenate([skin.triangles[:, [0, 1]], skin.triangles[:, [1, 2]]])
    outside = skin.normals[edges].sum(1)[:, 2] > 0.5
    a, b = edges[outside].T
    stretch = np.linalg.norm(moved[a] - moved[b], axis=1)
    length = np.linalg.norm(skin.positions[a] - skin.positions[b], axis=1)
    assert (stretch - 1.5 * length).max() < 0.0008


def test_a_lid_joint_shuts_the_eye(model: Model) -> None:
    """Seen from the front, the lashes of the upper lid come down to those of the lower lid."""
    lashes = model.surfaces["lashes"]
    for side in ("Left", "Right"):
        follows = lashes.weights_of(numbers(model, {f"lidUpper{side}"}))
        eye = model.places[f"eye{side}"]
        middle = np.abs(lashes.positions[:, 0] - eye[0]) < 0.006
        upper = middle & (follows > 0.5)
        lower = middle & (lashes.weights_of(numbers(model, {f"lidLower{side}"})) > 0.5)
        assert upper.sum() > 10
        assert lower.sum() > 10
        shut = posed(model, lashes, moved={f"lidUpper{side}": np.array([0, -0.009, 0])})
        open_by = np.median(lashes.positions[upper, 1]) - np.median(lashes.positions[lower, 1])
        shut_by = np.median(shut[upper, 1]) - np.median(lashes.positions[lower, 1])
        assert open_by > 0.006
        assert abs(shut_by) < 0.004


def test_all_52_shapes_are_there_and_each_moves_something(model: Model) -> None:
    assert len(model.shape_names) == 52
    assert set(model.shape_names) == ARKIT
    for number, name in enumerate(model.shape_names):
        reach = max(float(np.linalg.norm(s.targets[number], axis=1).max()) for s in model.surfaces.values())
        assert 0.001 < reach < 0.06, name


def test_shapes_move_eyes_teeth_tongue_and_lashes_too(model: Model) -> None:
    def moves(surface: str, shape: str) -> bool:
        return bool(np.abs(model.surfaces[surface].targets[model.shape_names.index(shape)]).max() > 0.001)

    assert all(
        moves("eyes", f"eyeLook{way}{side}") for way in ("Up", "Down", "In", "Out") for side in ("Left", "Right")
    )
    assert moves("mouth", "jawOpen")
    assert moves("mouth", "tongueOut")
    assert moves("lashes", "eyeBlinkLeft")
    assert not moves("mouth", "browInnerUp")
    assert not moves("eyes", "mouthSmileLeft")


def test_a_blink_on_the_left_leaves_the_right(model: Model, skin: Surface) -> None:
    blink = skin.targets[model.shape_names.index("eyeBlinkLeft")]
    assert np.linalg.norm(blink, axis=1)[skin.positions[:, 0] < -0.002].max() < 1e-4
    assert blink[:, 1].min() < -0.006


def test_the_skin_is_closed_and_every_edge_has_two_triangles(skin: Surface) -> None:
    triangles = welded(skin)
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert (uses == 2).all()


def rim_ring(surface: Surface) -> NDArray[Any]:
    """(R, 3) the vertices around the one in the middle of the base, which more triangles share than any other."""
    positions, index = np.unique(surface.positions, axis=0, return_inverse=True)
    triangles = index.ravel()[surface.triangles]
    hub = np.argmax(np.bincount(triangles.ravel()))
    ring = np.unique(triangles[(triangles == hub).any(1)])
    return np.asarray(positions[ring[ring != hub]])


def rim_normal(surface: Surface) -> NDArray[Any]:
    ring = rim_ring(surface)
    return np.asarray(np.linalg.svd(ring - ring.mean(0))[2][2])


def test_the_neck_ends_in_one_clean_loop(model: Model, skin: Surface) -> None:
    """The ring that closes the base is flat, convex seen from below, and lies under the head."""
    ring = rim_ring(skin) - rim_ring(skin).mean(0)
    assert len(ring) > 40
    assert np.abs(ring @ rim_normal(skin)).max() < 2e-4
    turn = np.sort(np.arctan2(ring[:, 2], ring[:, 0]))
    assert np.diff(turn).max() < 0.4
    assert skin.positions[:, 1].min() == pytest.approx(0, abs=1e-6)
    assert model.places["neck"][1] > 0.02


def test_the_foot_of_the_neck_follows_the_neck_alone(model: Model, skin: Surface) -> None:
    """Else a turn of the head would bend the rim: the base and the skin just above it, from the closing ring."""
    from_base = (skin.positions - rim_ring(skin).mean(0)) @ rim_normal(skin)
    base = np.abs(from_base) < 0.007
    assert base.sum() > 200
    assert skin.weights_of(numbers(model, {"neck"}))[base].min() > 0.99


def test_normals_are_unit_and_point_outwards(model: Model) -> None:
    for surface in model.surfaces.values():
        np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1, atol=1e-5)
    skin = model.surfaces["skin"]
    crown = skin.positions[:, 1] > model.places["forehead"][1]
    outwards = skin.positions[crown] - model.places["head"]
    assert ((skin.normals[crown] * outwards).sum(1) > 0).all()


def test_drawing_is_cheap(model: Model) -> None:
    assert len(model.surfaces) <= 4
    assert 5_000 < sum(len(s.positions) for s in model.surfaces.values()) < 12_000
