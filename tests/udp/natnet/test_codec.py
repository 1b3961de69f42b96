"""Values to bytes and back, in every version; what does not fit; what one version becomes in another."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from retarget.errors import InputError, ProtocolError
from retarget.udp.natnet.codec import HEADER, decode, encode
from retarget.udp.natnet.framedata import (
    FrameOfData,
    LabelledMarkers,
    MarkerSet,
    PrecisionTime,
)
from retarget.udp.natnet.messages import (
    Connect,
    ConnectionInfo,
    ConnectionOptions,
    Discovery,
    KeepAlive,
    Message,
    Request,
    RequestModelDef,
    Response,
    Sender,
    ServerInfo,
    Unknown,
)
from retarget.udp.natnet.models import DescribedMarkers, MarkerSetDescription, ModelDef, RigidBodyDescription
from retarget.udp.natnet.records import MARKER
from retarget.udp.natnet.version import Bitstream
from tests.udp.natnet.examples import SENDER, face_frame
from tests.udp.natnet.sameness import assert_same
from tests.udp.natnet.strategies import VERSIONS, commands, frames, models

by_version = pytest.mark.parametrize("version", VERSIONS, ids=str)
drawn = settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large]
)


def round_trip(message: Message, version: Bitstream | None = None) -> Message:
    return decode(encode(message, version), version)


@by_version
@drawn
@given(data=st.data())
def test_every_frame_comes_back_as_it_was(version: Bitstream, data: st.DataObject) -> None:
    frame = data.draw(frames(version))
    assert_same(round_trip(frame, version), frame)


@by_version
@drawn
@given(data=st.data())
def test_every_model_definition_comes_back_as_it_was(version: Bitstream, data: st.DataObject) -> None:
    definition = data.draw(models(version))
    assert_same(round_trip(definition, version), definition)


@settings(max_examples=300, deadline=None)
@given(message=commands)
def test_every_command_comes_back_as_it_was(message: Message) -> None:
    assert_same(round_trip(message), message)


@drawn
@given(data=st.data(), source=st.sampled_from(VERSIONS), target=st.sampled_from(VERSIONS))
def test_a_frame_of_any_version_can_be_written_in_any_other(
    data: st.DataObject, source: Bitstream, target: Bitstream
) -> None:
    frame = data.draw(frames(source))
    try:
        converted = round_trip(frame, target)
    except InputError as error:
        assert "do not fit" in str(error)  # noqa: PT017  a float64 beyond float32's range
        return
    assert isinstance(converted, FrameOfData)
    assert converted.number == frame.number
    assert converted.labelled.positions.tobytes() == frame.labelled.positions.tobytes()
    assert [s.name for s in converted.marker_sets] == [s.name for s in frame.marker_sets]
    assert converted.bodies.quats_xyzw.tobytes() == frame.bodies.quats_xyzw.tobytes()


@pytest.mark.parametrize("version", [v for v in VERSIONS if v >= (2, 6)], ids=str)
def test_markers_and_flags_survive_every_version_that_has_them(version: Bitstream) -> None:
    frame = face_frame()
    read = round_trip(frame, version)
    assert isinstance(read, FrameOfData)
    np.testing.assert_array_equal(read.labelled.params, frame.labelled.params)
    np.testing.assert_array_equal(read.bodies.tracked, [True])
    assert read.timestamp_s == 12.25
    flags = (read.recording, read.models_changed, read.edit_mode, read.bitstream_changed)
    assert flags == (False, True, False, False)
    assert np.isnan(read.labelled.residuals).all() == (version < (3, 0))


def test_the_precision_time_of_4_0_is_told_by_the_bytes_left() -> None:
    version = Bitstream(4, 0)
    with_precision = encode(face_frame(), version)
    without = encode(decode(encode(face_frame(), Bitstream(3, 1)), Bitstream(3, 1)), version)
    assert len(with_precision) == len(without) + 8
    read = decode(with_precision, version)
    assert isinstance(read, FrameOfData)
    assert read.precision == PrecisionTime(77, 2**31)
    read = decode(without, version)
    assert isinstance(read, FrameOfData)
    assert read.precision is None


def test_a_new_client_is_recognised_in_all_four_forms() -> None:
    header = HEADER.pack(0, 0)
    sender = encode(Connect(SENDER))[HEADER.size :]
    assert decode(header) == Connect()
    assert decode(header + b"Ping\0") == Connect(extra=b"Ping\0")
    assert decode(header + sender) == Connect(SENDER)
    wanted = decode(header + sender + bytes([0, 4, 1, 0, 0, 0, 0]))
    assert isinstance(wanted, Connect)
    assert wanted.options == ConnectionOptions(0, (4, 1, 0, 0))
    assert wanted.options.bitstream == (4, 1)
    assert wanted.extra == bytes(2)


def test_a_client_may_leave_the_version_to_the_server() -> None:
    assert ConnectionOptions(1, (0, 0, 0, 0)).bitstream is None


@pytest.mark.parametrize("extra", [b"Ping", b"Ping\0\0", b"Ping\0Pong\0", bytes(263), bytes(268), bytes(280)])
def test_other_forms_of_connect_are_refused(extra: bytes) -> None:
    with pytest.raises(ProtocolError):
        decode(HEADER.pack(0, 0) + extra)


def test_server_infos_of_old_and_new_servers_have_their_sizes() -> None:
    old, new = ServerInfo(SENDER), ServerInfo(SENDER, ConnectionInfo(10_000_000, 1511, 0, "239.255.42.99"))
    assert len(encode(old)) == 4 + 264
    assert len(encode(new)) == 4 + 279
    assert decode(encode(old)) == old
    assert decode(encode(new)) == new


def test_a_response_is_read_as_what_the_request_asked_for() -> None:
    assert Response.of_int32(-1).int32 == -1
    assert Response.of_float32(119.5).float32 == 119.5
    assert Response.of_text("Bitstream,4.1").text == "Bitstream,4.1"
    assert Response.of_text("Bitstream,4.1").int32 is None
    assert Response.of_text("Bitstream,4.1").float32 is None


def test_text_without_its_nul_is_text_though_it_is_as_long_as_a_number() -> None:
    assert Response(b"true").text == "true"


def test_requests_are_commands_with_parameters() -> None:
    request = Request.of("SetPlaybackCurrentFrame", 250)
    assert request.octets == b"SetPlaybackCurrentFrame,250\0"
    assert (request.command, request.parameters) == ("SetPlaybackCurrentFrame", ("250",))
    assert Request.of("FrameRate").parameters == ()


def test_a_nul_behind_an_empty_message_is_kept_and_anything_else_is_refused() -> None:
    assert decode(bytes([10, 0, 0, 0, 0])) == KeepAlive(b"\0")
    assert decode(bytes([4, 0, 0, 0, 0])) == RequestModelDef(b"\0")
    for extra in (b"\1", b"\0\0"):
        with pytest.raises(ProtocolError):
            decode(HEADER.pack(10, 0) + extra)


def test_an_unknown_message_is_a_value_and_not_an_error() -> None:
    assert decode(HEADER.pack(77, 3) + b"abc") == Unknown(77, b"abc")


def test_a_frame_without_a_known_version_is_refused() -> None:
    datagram = encode(face_frame(), Bitstream(4, 1))
    for version in (None, Bitstream(2, 4), Bitstream(4, 4), Bitstream(5, 0)):
        with pytest.raises(ProtocolError, match="itstream"):
            decode(datagram, version)


@pytest.mark.parametrize(
    ("message", "saying"),
    [
        (FrameOfData(2**31), "do not fit"),
        (FrameOfData(1, timestamp_s=0.0, params=-1), "do not fit"),
        (FrameOfData(1, (MarkerSet("a\0b", np.zeros((1, 3), "<f4")),)), "NUL"),
        (FrameOfData(1, (MarkerSet("a\ud800", np.zeros((1, 3), "<f4")),)), "UTF-8"),
        (FrameOfData(1, (MarkerSet("a", np.zeros((1, 4), "<f4")),)), "shape"),
        (FrameOfData(1, labelled=LabelledMarkers(np.zeros(3000, MARKER))), "too long"),
        (ServerInfo(SENDER, ConnectionInfo(1, 1511, 1, "localhost")), "IPv4"),
        (ServerInfo(SENDER, ConnectionInfo(1, 70000, 1, "239.255.42.99")), "do not fit"),
        (ServerInfo(Sender(b"short", (1, 0, 0, 0), (4, 1, 0, 0))), "256"),
        (Connect(options=ConnectionOptions(0, (4, 1, 0, 0))), "Options"),
        (Discovery(SENDER, extra=b"\0"), "Options"),
    ],
)
def test_what_does_not_fit_is_refused_in_a_sentence(message: Message, saying: str) -> None:
    with pytest.raises(InputError, match=saying):
        encode(message, Bitstream(4, 1))


def test_a_rigid_body_with_markers_but_too_few_names_is_refused() -> None:
    markers = DescribedMarkers(np.zeros((2, 3), "<f4"), np.zeros(2, "<i4"), ("one",))
    body = RigidBodyDescription("Band", 1, -1, np.zeros(3, "<f4"), None, markers)
    with pytest.raises(InputError, match="2 markers and 1"):
        encode(ModelDef((body,)), Bitstream(4, 1))


def test_a_name_that_is_too_long_for_a_sender_is_refused() -> None:
    assert Sender.named("é" * 127, (1, 0, 0, 0), (4, 1, 0, 0)).name == "é" * 127
    with pytest.raises(InputError, match="255"):
        Sender.named("é" * 128, (1, 0, 0, 0), (4, 1, 0, 0))


def description(kind: int, body: bytes) -> bytes:
    return kind.to_bytes(4, "little") + len(body).to_bytes(4, "little") + body


def definition(*bodies: bytes) -> bytes:
    return HEADER.pack(5, 0) + len(bodies).to_bytes(4, "little") + b"".join(bodies)


def test_from_4_1_a_description_that_is_not_understood_is_skipped_by_its_size() -> None:
    names = MarkerSetDescription("Face", ("browInnerLeft", "chin"))
    good = encode(ModelDef((names,)), Bitstream(4, 1))[8:]
    datagram = definition(description(9, b"future"), description(5, b"Camera without an end"), good)
    read = decode(datagram, Bitstream(4, 1))
    assert isinstance(read, ModelDef)
    assert read.marker_sets == (names,)
    assert [note.split("(")[0] for note in read.notes] == ["A description of type 9 ", "A description of type 5 "]
    assert encode(read, Bitstream(4, 1))[4:] == datagram[4:]


def test_before_4_1_an_unknown_description_hides_the_rest_and_a_note_says_so() -> None:
    names = MarkerSetDescription("Face", ("browInnerLeft", "chin"))
    good = encode(ModelDef((names,)), Bitstream(3, 1))[8:]
    read = decode(definition(good, b"\x09\0\0\0future", good), Bitstream(3, 1))
    assert isinstance(read, ModelDef)
    assert read.marker_sets == (names,)
    assert len(read.notes) == 1
    assert "2 descriptions" in read.notes[0]
    assert "type 9" in read.notes[0]


def test_unread_descriptions_are_not_written_where_sizes_are_needed() -> None:
    read = decode(definition(b"\x09\0\0\0future"), Bitstream(3, 1))
    with pytest.raises(InputError, match=r"4\.1"):
        encode(read, Bitstream(4, 1))


@pytest.mark.parametrize("version", [v for v in VERSIONS if v >= (4, 1)], ids=str)
def test_a_section_whose_size_does_not_add_up_is_refused(version: Bitstream) -> None:
    datagram = encode(face_frame(), version)
    for delta in (-1, 1, 12, -(2**20)):
        size = int.from_bytes(datagram[12:16], "little") + delta
        lying = datagram[:12] + size.to_bytes(4, "little", signed=True) + datagram[16:]
        with pytest.raises(ProtocolError, match="announces"):
            decode(lying, version)


def test_a_frame_that_does_not_end_with_zero_is_refused() -> None:
    datagram = encode(face_frame(), Bitstream(4, 1))
    with pytest.raises(ProtocolError, match="in place of 0"):
        decode(datagram[:-1] + b"\1", Bitstream(4, 1))
