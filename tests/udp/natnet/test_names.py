"""Names of markers: real frames of three servers, and frames made to mislead."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.udp.natnet.codec import decode
from retarget.udp.natnet.framedata import FrameOfData, LabelledMarkers, MarkerSet
from retarget.udp.natnet.models import (
    AssetDescription,
    AssetMarkerDescription,
    MarkerSetDescription,
    ModelDef,
    RigidBodyDescription,
)
from retarget.udp.natnet.names import MarkerNames
from retarget.udp.natnet.records import MARKER, MarkerFlag
from retarget.udp.natnet.version import Bitstream
from tests.udp.natnet.captures import OCCLUDED, SESSION_VERSION, needs_captures, of_session, single_datagrams

if TYPE_CHECKING:
    from numpy.typing import NDArray

FACE = ("brow", "nose", "chin")
SEEN = MarkerFlag.POINT_CLOUD_SOLVED | MarkerFlag.HAS_MODEL


def _points(count: int, start: float = 0.5) -> NDArray[np.float32]:
    return np.linspace(start, start + count, 3 * count, dtype=np.float32).reshape(count, 3)


def _labelled(ids: list[int], positions: object, params: list[int] | int = SEEN) -> LabelledMarkers:
    table = np.zeros(len(ids), MARKER)
    table["id"], table["position"], table["params"], table["residual"] = ids, positions, params, 1e-4
    return LabelledMarkers(table)


def _asset(asset_id: int, members: list[int]) -> list[int]:
    return [asset_id << 16 | member for member in members]


def _face(*names: str) -> ModelDef:
    return ModelDef((MarkerSetDescription("face", names or FACE), MarkerSetDescription("all", names or FACE)))


def _sets(positions: object) -> tuple[MarkerSet, ...]:
    points = np.asarray(positions, np.float32)
    return (MarkerSet("face", points), MarkerSet("all", points))


def _name(names: MarkerNames, frame: FrameOfData) -> dict[str, tuple[float, ...]]:
    """What was seen, by name."""
    named = names.name(frame)
    rows = zip(named.layout.names, named.positions.tolist(), strict=True)
    return {name: tuple(row) for name, row in rows if not np.isnan(row).any()}


def _described(definitions: ModelDef) -> MarkerNames:
    names = MarkerNames()
    names.describe(definitions)
    return names


@needs_captures
def test_a_real_session_names_its_rigid_bodys_markers() -> None:
    models, frame = decode(of_session(5)[0], SESSION_VERSION), decode(of_session(7)[0], SESSION_VERSION)
    assert isinstance(models, ModelDef)
    assert isinstance(frame, FrameOfData)
    names = _described(models)
    named = names.name(frame)
    assert named.layout.names == ("Marker1", "Marker2", "Marker3", "Marker4", "Marker5")
    assert named.positions[0] == pytest.approx([0.127216, 1.505028, -0.885828], abs=1e-6)
    assert named.positions[4] == pytest.approx([0.321399, 1.414651, -0.752954], abs=1e-6)
    assert named.unlabelled == pytest.approx(np.array([[0.170812, 1.507659, -0.840235]]), abs=1e-6)


@needs_captures
def test_a_real_occluded_marker_and_one_that_is_left_out_are_not_seen() -> None:
    frame = decode(OCCLUDED.read_bytes(), SESSION_VERSION)
    assert isinstance(frame, FrameOfData)
    tree = ModelDef((MarkerSetDescription("FakeTree", ("a", "b", "c", "d", "e")),))
    assert set(_name(_described(tree), frame)) == {"c", "d", "e"}


@needs_captures
def test_real_frames_of_2_5_and_2_9_are_named_even_without_definitions() -> None:
    for file_name, version, datagram in single_datagrams():
        if version >= (3, 0) or file_name.endswith("_000.bin"):
            continue
        frame = decode(datagram, version)
        assert isinstance(frame, FrameOfData)
        named = MarkerNames().name(frame)
        subject = "Rigid Body 1" if version == Bitstream(2, 5) else "Triangle"
        assert named.layout.names == tuple(f"{subject}_{i}" for i in (1, 2, 3))
        assert np.array_equal(named.positions, frame.marker_sets[0].positions.astype(float))
        assert len(named.unlabelled) == (2 if version == Bitstream(2, 5) else 0)


def test_a_marker_set_without_an_id_is_found_by_its_positions() -> None:
    names = _described(ModelDef((MarkerSetDescription("band", ("l", "r", "b")), *_face().marker_sets)))
    points = _points(3)
    sets = (MarkerSet("band", _points(3, 7.0)), *_sets(points))
    frame = FrameOfData(1, sets, labelled=_labelled(_asset(9, [3, 1, 2]), points[[2, 0, 1]]))
    seen = _name(names, frame)
    assert {name: seen[name] for name in FACE} == dict(
        zip(FACE, map(tuple, points.astype(float).tolist()), strict=True)
    )


def test_what_was_learnt_holds_when_no_position_agrees_any_more() -> None:
    names = _described(ModelDef((MarkerSetDescription("band", ("l", "r", "b")), *_face().marker_sets)))
    points = _points(3)
    names.name(FrameOfData(1, _sets(points), labelled=_labelled(_asset(9, [1, 2, 3]), points)))
    moved = FrameOfData(2, labelled=_labelled(_asset(9, [2]), points[:1] + 1))
    assert set(_name(names, moved)) == {"nose"}


def test_member_ids_counted_from_0_are_recognised_by_their_positions() -> None:
    points = _points(3)
    frame = FrameOfData(1, _sets(points), labelled=_labelled(_asset(9, [1, 2, 0]), points[[1, 2, 0]]))
    assert _name(_described(_face()), frame)["brow"] == tuple(points[0].astype(float))


def test_a_first_frame_without_any_position_still_puts_the_names_in_order() -> None:
    names = _described(_face())
    hidden = FrameOfData(1, _sets(np.zeros((3, 3))), labelled=_labelled(_asset(9, [1, 2, 3]), 0, MarkerFlag.OCCLUDED))
    assert _name(names, hidden) == {}
    assert names.layout.names == FACE
    points = _points(3)
    assert set(_name(names, FrameOfData(2, _sets(points), labelled=_labelled(_asset(9, [1, 2, 3]), points)))) == set(
        FACE
    )


def test_occluded_filled_in_and_unresolved_markers_are_not_seen() -> None:
    points = _points(3)
    markers = _labelled(
        _asset(9, [1, 2, 3]), points, [SEEN | MarkerFlag.OCCLUDED, SEEN | MarkerFlag.MODEL_FILLED, SEEN]
    )
    assert set(_name(_described(_face()), FrameOfData(1, _sets(points), labelled=markers))) == {"chin"}
    doubtful = _labelled(_asset(9, [1, 2, 3]), points)
    doubtful.table["residual"] = [-1.0, np.nan, 0.0]
    assert set(_name(_described(_face()), FrameOfData(1, _sets(points), labelled=doubtful))) == {"chin"}


def test_a_stream_of_marker_sets_alone_is_read_from_them() -> None:
    points = _points(3)
    points[1] = 0.0
    assert set(_name(_described(_face()), FrameOfData(1, _sets(points)))) == {"brow", "chin"}


def test_two_performers_with_the_same_markers_are_told_apart() -> None:
    models = ModelDef((MarkerSetDescription("Ana", FACE), MarkerSetDescription("Ben", (*FACE, "cap"))))
    names = _described(models)
    assert names.layout.names == (*(f"Ana:{n}" for n in FACE), *(f"Ben:{n}" for n in FACE), "cap")


def test_names_are_unique_whatever_a_server_sends() -> None:
    names = _described(ModelDef((MarkerSetDescription("x", ("a", "a", "a_2", "a")),)))
    assert len(set(names.layout.names)) == 4


def test_rigid_bodies_and_trained_assets_give_their_ids_themselves() -> None:
    zero = np.zeros(3, np.float32)
    marker = AssetMarkerDescription("chin", 3, zero, np.float32(0.004), 0)
    other = AssetMarkerDescription("brow", 1, zero, np.float32(0.004), 0)
    models = ModelDef(
        (
            MarkerSetDescription("Band", ("l", "r")),
            RigidBodyDescription("Band", 7, -1, zero),
            AssetDescription("Ana", 1, 4, (), (marker, other)),
        )
    )
    points = _points(3)
    frame = FrameOfData(1, labelled=_labelled([*_asset(7, [2]), *_asset(4, [1, 3])], points))
    seen = _name(_described(models), frame)
    assert seen["r"] == tuple(points[0].astype(float))
    assert seen["brow"] == tuple(points[1].astype(float))
    assert seen["chin"] == tuple(points[2].astype(float))


def test_an_undescribed_asset_and_active_markers_are_named_by_their_ids() -> None:
    frame = FrameOfData(1, labelled=_labelled([*_asset(5, [2]), 77], _points(2), [SEEN, SEEN | MarkerFlag.ACTIVE]))
    assert set(_name(_described(ModelDef()), frame)) == {"id_5_2", "active_77"}


def test_loose_points_are_unlabelled_and_never_become_names() -> None:
    names = _described(_face())
    for number in range(50):
        loose = _labelled([1000 + number], _points(1), MarkerFlag.POINT_CLOUD_SOLVED | MarkerFlag.UNLABELLED)
        named = names.name(FrameOfData(number, labelled=loose, other_markers=loose.positions))
        assert named.unlabelled.shape == (1, 3)
    assert names.layout.names == FACE


def test_the_layout_is_the_same_object_as_long_as_its_names_are() -> None:
    names = _described(_face())
    layout = names.layout
    points = _points(3)
    for number in range(3):
        frame = FrameOfData(number, _sets(points), labelled=_labelled(_asset(9, [1, 2, 3]), points))
        assert names.name(frame).layout is layout
    names.describe(_face())
    assert names.layout is layout
    names.describe(_face("brow", "nose", "jaw"))
    assert names.layout is not layout


def test_a_frame_whose_sets_are_not_those_described_is_noticed() -> None:
    names = _described(_face())
    assert names.agrees_with(FrameOfData(1, _sets(_points(3))))
    assert not names.agrees_with(FrameOfData(1, _sets(_points(4))))
    assert not names.agrees_with(FrameOfData(1, (MarkerSet("hat", _points(2)),)))


def test_one_position_is_never_given_twice_to_one_name() -> None:
    points = _points(2)
    frame = FrameOfData(1, labelled=_labelled(_asset(9, [1, 1]), points))
    named = _described(_face()).name(frame)
    assert named.positions[0] == pytest.approx(points[0])
    assert len(named.unlabelled) == 1


def test_a_flood_of_undescribed_ids_is_bounded() -> None:
    names = _described(_face())
    for start in range(1, 12):
        ids = [asset << 16 | 1 for asset in range(1000 * start, 1000 * start + 900)]
        names.name(FrameOfData(start, labelled=_labelled(ids, 1.0)))
    assert len(names.layout.names) <= 4096
