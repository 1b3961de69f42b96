"""The codec against what real servers and clients sent, and against what the vendor's client made of it."""

from __future__ import annotations

from itertools import pairwise
from typing import TypeVar

import numpy as np
import pytest

from retarget.udp.natnet.codec import HEADER, decode, encode
from retarget.udp.natnet.framedata import FrameOfData
from retarget.udp.natnet.messages import (
    Connect,
    Discovery,
    EchoRequest,
    EchoResponse,
    MessageId,
    Request,
    RequestModelDef,
    Response,
    ServerInfo,
    UnrecognizedRequest,
)
from retarget.udp.natnet.models import ModelDef
from retarget.udp.natnet.version import Bitstream
from tests.udp.natnet.captures import OCCLUDED, SESSION_VERSION, needs_captures, of_session, session, single_datagrams
from tests.udp.natnet.vendor_output import frame_lines, model_lines, printed_frames, printed_models

T = TypeVar("T")
pytestmark = needs_captures


def _of_kind(kind: type[T]) -> list[T]:
    return [m for m in (decode(d, SESSION_VERSION) for d in session()) if isinstance(m, kind)]


def test_every_datagram_of_the_real_session_is_written_back_to_the_same_bytes() -> None:
    assert len(session()) == 550
    for datagram in session():
        assert encode(decode(datagram, SESSION_VERSION), SESSION_VERSION) == datagram


def test_the_real_session_holds_what_it_is_known_to_hold() -> None:
    counts = {
        kind: len(_of_kind(kind)) for kind in (FrameOfData, ModelDef, EchoRequest, EchoResponse, Request, Response)
    }
    assert counts == {FrameOfData: 518, ModelDef: 1, EchoRequest: 9, EchoResponse: 9, Request: 4, Response: 3}
    singles = (Discovery, Connect, RequestModelDef, UnrecognizedRequest)
    assert [len(_of_kind(kind)) for kind in singles] == [1, 1, 1, 1]


def test_frames_agree_line_by_line_with_what_the_vendors_client_printed() -> None:
    (info, _) = _of_kind(ServerInfo)
    assert info.connection is not None
    printed = printed_frames()
    assert len(printed) == 251
    for frame, lines in zip(_of_kind(FrameOfData), printed, strict=False):
        assert list(frame_lines(frame, info.connection.clock_hz)) == lines


def test_the_model_definition_agrees_with_what_the_vendors_client_printed() -> None:
    (models,) = _of_kind(ModelDef)
    assert list(model_lines(models)) == printed_models()
    assert models.notes == ()


def test_frame_numbers_have_no_gap_and_all_clocks_go_forward() -> None:
    frames = _of_kind(FrameOfData)
    assert [f.number for f in frames] == list(range(162734, 163252))
    for before, after in pairwise(frames):
        assert before.ticks is not None
        assert after.ticks is not None
        assert before.ticks.transmit < after.ticks.mid_exposure + 100_000
        assert after.ticks.mid_exposure < after.ticks.received < after.ticks.transmit
        assert (after.timestamp_s or 0) - (before.timestamp_s or 0) == pytest.approx(1 / 120)


def test_the_rigid_body_of_the_first_frame_is_where_it_was() -> None:
    frame = _of_kind(FrameOfData)[0]
    assert list(frame.bodies.ids) == [2]
    assert frame.bodies.positions[0] == pytest.approx([0.174447, 1.447131, -0.734304], abs=1e-6)
    assert np.linalg.norm(frame.bodies.quats_xyzw[0]) == pytest.approx(1, abs=1e-6)
    assert list(frame.labelled.unlabelled) == [False] * 5 + [True]
    assert frame.labelled.measured.all()
    assert frame.labelled.residuals.max() < 2e-3


def test_the_server_info_is_read_past_the_stale_bytes_of_its_name() -> None:
    (info, again) = _of_kind(ServerInfo)
    assert info == again
    assert info.sender.name == "Motive"
    assert b"ib\0" in info.sender.name_field
    assert info.sender.app_version == (2, 1, 0, 0)
    assert info.sender.bitstream == (3, 0)
    assert info.connection is not None
    assert info.connection.clock_hz == 3_312_787
    assert (info.connection.data_port, info.connection.group) == (1511, "239.255.42.99")
    assert info.connection.is_multicast


def test_questions_and_answers_are_read_as_the_vendors_client_did() -> None:
    requests = [r.command for r in _of_kind(Request)]
    assert requests[1:] == ["FrameRate", "AnalogSamplesPerMocapFrame", "TestRequest"]
    assert _of_kind(Request)[0].parameters[0] == "-1"
    _, rate, samples = _of_kind(Response)
    assert rate.float32 == 120.0
    assert samples.int32 == 0


def test_echoes_come_in_pairs_and_bring_the_servers_clock() -> None:
    for request, response in zip(_of_kind(EchoRequest), _of_kind(EchoResponse), strict=True):
        assert request.client_stamp == response.client_stamp
    ticks = [r.server_ticks for r in _of_kind(EchoResponse)]
    assert all(before < after for before, after in pairwise(ticks))


def test_single_captured_datagrams_are_written_back_to_the_same_bytes() -> None:
    assert len(single_datagrams()) == 7
    for name, version, datagram in single_datagrams():
        assert encode(decode(datagram, version), version) == datagram, name


@pytest.mark.parametrize(
    ("name", "number", "count", "app"),
    [
        ("motive-1.5.0_natnet-2.5_001.bin", 92881, 3, (2, 5)),
        ("motive-1.5.0_natnet-2.5_002.bin", 92882, 3, (2, 5)),
        ("motive-1.9.0_natnet-2.9_001.bin", 11823217, 3, (2, 9)),
        ("motive-1.9.0_natnet-2.9_002.bin", 11823218, 3, (2, 9)),
    ],
)
def test_older_frames_say_the_same_in_every_section(name: str, number: int, count: int, app: tuple[int, int]) -> None:
    version, datagram = {n: (v, d) for n, v, d in single_datagrams()}[name]
    assert version == app
    frame = decode(datagram, version)
    assert isinstance(frame, FrameOfData)
    assert frame.number == number
    assert [len(s.positions) for s in frame.marker_sets] == [count, count]
    assert frame.marker_sets[1].name == "all"
    np.testing.assert_array_equal(frame.labelled.positions, frame.marker_sets[0].positions)
    np.testing.assert_allclose(frame.bodies.markers[0].positions, frame.labelled.positions, atol=1e-4)
    np.testing.assert_array_equal(frame.bodies.markers[0].ids, frame.labelled.member_ids)
    np.testing.assert_array_equal(frame.bodies.markers[0].sizes, frame.labelled.sizes)


def test_older_servers_say_nothing_of_a_clock() -> None:
    infos = [decode(d, v) for n, v, d in single_datagrams() if n.endswith("_000.bin")]
    assert [i.sender.bitstream for i in infos if isinstance(i, ServerInfo)] == [Bitstream(2, 5), Bitstream(2, 9)]
    assert all(isinstance(i, ServerInfo) and i.connection is None for i in infos)


def test_an_occluded_marker_is_told_apart_though_it_has_a_position() -> None:
    frame = decode(OCCLUDED.read_bytes(), SESSION_VERSION)
    assert isinstance(frame, FrameOfData)
    assert frame.number == 269007
    assert list(frame.labelled.member_ids) == [2, 3, 4, 5]
    assert list(frame.labelled.occluded) == [True, False, False, False]
    assert list(frame.labelled.measured) == [False, True, True, True]
    in_set = {s.name: s for s in frame.marker_sets}["FakeTree"].positions
    np.testing.assert_array_equal(in_set[1:], frame.labelled.positions)


def test_arrays_of_a_decoded_frame_are_views_of_the_datagram_and_cannot_be_written() -> None:
    frame = decode(of_session(MessageId.FRAMEOFDATA)[0], SESSION_VERSION)
    assert isinstance(frame, FrameOfData)
    for array in (frame.other_markers, frame.labelled.table, frame.labelled.positions, frame.bodies.positions):
        assert array.base is not None
        with pytest.raises(ValueError, match="read-only"):
            array[0] = array[0]


def test_the_size_in_the_header_is_not_believed() -> None:
    datagram = of_session(MessageId.FRAMEOFDATA)[0]
    lying = HEADER.pack(MessageId.FRAMEOFDATA, 0) + datagram[HEADER.size :]
    frame = decode(lying, SESSION_VERSION)
    assert isinstance(frame, FrameOfData)
    assert encode(frame, SESSION_VERSION) == datagram
