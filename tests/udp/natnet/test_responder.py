"""A server's answers, and to whom it gives how many."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from retarget.udp.natnet.clients import MAX_CLIENTS, SILENCE_S, UNPROVEN_S, Allowance, Clients
from retarget.udp.natnet.codec import decode, encode
from retarget.udp.natnet.framedata import FrameOfData
from retarget.udp.natnet.messages import (
    Connect,
    ConnectionOptions,
    Discovery,
    EchoRequest,
    EchoResponse,
    KeepAlive,
    Message,
    Request,
    RequestFrameOfData,
    RequestModelDef,
    Response,
    Sender,
    ServerInfo,
    UnrecognizedRequest,
)
from retarget.udp.natnet.models import ModelDef
from retarget.udp.natnet.playback import AtEnd, Playback
from retarget.udp.natnet.requests import answer_request
from retarget.udp.natnet.version import Bitstream
from tests.udp.natnet.wire import CLIENT, CLOCK_HZ, NAMES, responder

if TYPE_CHECKING:
    from retarget.udp.natnet.responder import Responder

V31, V41, V42 = Bitstream(3, 1), Bitstream(4, 1), Bitstream(4, 2)
SENDER = Sender.named("client", (1, 0, 0, 0), (4, 1, 0, 0))


def _ask(server: Responder, message: Message, version: Bitstream = V41, at_s: float = 1.0) -> Message | None:
    answer = server.answer(encode(message), CLIENT, at_s)
    return None if answer is None else decode(answer, version)


def _wanting(version: Bitstream) -> Connect:
    return Connect(SENDER, ConnectionOptions(0, (*version, 0, 0)))


@pytest.mark.parametrize(
    "connect",
    [b"\0\0\0\0", b"\0\0\5\0Ping\0", encode(Connect(SENDER)), encode(_wanting(V41)) + b"\0\0"],
    ids=["empty", "greeting", "sender", "vendor's sample"],
)
def test_every_form_of_connect_is_accepted(connect: bytes) -> None:
    server = responder(V41)
    answer = server.answer(connect, CLIENT, 1.0)
    assert answer is not None
    assert len(answer) == 4 + 279
    info = decode(answer)
    assert isinstance(info, ServerInfo)
    assert info.sender.bitstream == V41
    assert server.clients.addresses() == [CLIENT]


def test_a_server_of_2_9_answers_as_those_did() -> None:
    answer = responder(Bitstream(2, 9)).answer(b"\0\0\0\0", CLIENT, 1.0)
    assert answer is not None
    assert len(answer) == 4 + 264


@pytest.mark.parametrize(
    ("own", "wanted", "given"),
    [
        (V42, V41, V41),
        (V42, V31, V31),
        (V41, V42, V41),
        (V31, V41, V31),
        (V31, Bitstream(3, 0), V31),
        (V41, (9, 9), V41),
    ],
)
def test_a_client_gets_the_bitstream_it_wants_up_to_the_servers_own(
    own: Bitstream, wanted: Bitstream, given: Bitstream
) -> None:
    info = _ask(responder(own), _wanting(wanted))
    assert isinstance(info, ServerInfo)
    assert info.sender.bitstream == given


def test_the_bitstream_can_be_asked_for_and_changed_in_unicast() -> None:
    server = responder(V42)
    _ask(server, Connect())
    answer = _ask(server, Request.of("Bitstream"))
    assert isinstance(answer, Response)
    assert answer.text == "Bitstream,4.2"
    assert _ask(server, Request.of("Bitstream", "3.1")) == Response.of_int32(0)
    assert server.clients.by_bitstream() == {V31: [CLIENT]}
    assert _ask(server, Request.of("Bitstream", "4.3")) == Response.of_int32(1)
    assert _ask(server, Request.of("Bitstream", "banana")) == Response.of_int32(1)


def test_multicast_has_one_bitstream_for_all() -> None:
    server = responder(V42, group="239.255.42.99")
    info = _ask(server, _wanting(V31))
    assert isinstance(info, ServerInfo)
    assert info.sender.bitstream == V42
    assert info.connection is not None
    assert info.connection.is_multicast
    assert _ask(server, Request.of("Bitstream", "3.1")) == Response.of_int32(1)


def test_definitions_and_frames_come_in_the_clients_bitstream() -> None:
    server = responder(V42)
    _ask(server, _wanting(V31))
    models = _ask(server, RequestModelDef(b"\0"), V31)
    assert isinstance(models, ModelDef)
    assert [s.marker_names for s in models.marker_sets] == [NAMES, NAMES]
    frame = _ask(server, RequestFrameOfData(), V31)
    assert isinstance(frame, FrameOfData)
    assert len(frame.labelled) == 3


def test_the_clock_is_told_and_a_discovery_adds_no_client() -> None:
    server = responder(V41)
    assert isinstance(_ask(server, Discovery(SENDER)), ServerInfo)
    assert _ask(server, EchoRequest(2**63), at_s=2.5) == EchoResponse(2**63, int(2.5 * CLOCK_HZ))
    assert len(server.clients) == 0


def test_garbage_is_counted_and_not_answered() -> None:
    server = responder(V41)
    for octets in (b"", b"\0", b"\x0c\0\1\0x", b"\0\0\7\0\xff\xff\xff\xff\xff\xff\xff"):
        assert server.answer(octets, CLIENT, 1.0) is None
    assert server.malformed == 4


def test_a_client_stays_as_long_as_it_speaks() -> None:
    server = responder(V41)
    _ask(server, Connect())
    for second in range(60):
        assert _ask(server, KeepAlive(b"\0"), at_s=1.0 + second) is None
        assert server.clients.expire(1.0 + second) == []
    assert [client.address for client in server.clients.expire(61.0 + SILENCE_S)] == [CLIENT]
    assert len(server.clients) == 0


def test_one_that_never_speaks_after_its_connect_is_dropped_sooner() -> None:
    server = responder(V41)
    _ask(server, Connect())
    assert server.clients.expire(1.0 + UNPROVEN_S - 0.01) == []
    assert len(server.clients.expire(1.0 + UNPROVEN_S + 0.01)) == 1


def test_a_flood_of_connects_is_bounded_and_disturbs_no_client() -> None:
    server = responder(V41)
    _ask(server, Connect())
    _ask(server, KeepAlive())
    connect = encode(Connect())
    sent = 0
    for port in range(1, 60_000):
        answer = server.answer(connect, ("192.0.2.66", port), 1.0 + port / 60_000)
        sent += 0 if answer is None else len(answer)
    assert len(server.clients) == MAX_CLIENTS
    assert server.clients.get(CLIENT) is not None
    assert server.clients.refused > 50_000
    assert sent < 200_000


def test_strangers_get_only_so_many_bytes_a_second() -> None:
    server = responder(V41, tuple(f"marker{i}" for i in range(500)))
    question = encode(RequestModelDef())
    sent = [server.answer(question, ("192.0.2.66", port), 1.0 + port / 1000) for port in range(1, 10_000)]
    total = sum(len(answer) for answer in sent if answer is not None)
    assert 100_000 < total < 131_072 + 10 * 32_768


def test_an_allowance_recovers_and_never_exceeds_its_most() -> None:
    allowance = Allowance(rate=100.0, most=1000.0)
    assert allowance.grants(1000, 1.0)
    assert not allowance.grants(1, 1.0)
    assert allowance.grants(100, 2.0)
    assert not allowance.grants(1001, 1e6)
    assert allowance.grants(1000, 1e6)


def test_clients_are_ready_with_definitions_or_after_a_while() -> None:
    clients = Clients()
    client = clients.connect(CLIENT, V41, 1.0)
    assert client is not None
    assert not clients.anyone_ready(2.0, 2.0)
    assert clients.anyone_ready(3.0, 2.0)
    client.informed = True
    assert clients.anyone_ready(1.0, 2.0)


def test_requests_move_the_playback() -> None:
    playback = Playback(100)

    def do(command: str, *parameters: object) -> Response | UnrecognizedRequest:
        return answer_request(Request.of(command, *parameters), playback, 60.0)

    done, failed = Response.of_int32(0), Response.of_int32(1)
    assert do("TimelineStop") == done
    assert not playback.playing
    assert do("TimelinePlay") == done
    assert playback.playing
    assert do("SetPlaybackCurrentFrame", 50) == done
    assert playback.index == 50
    assert do("SetPlaybackStartFrame", 60) == done
    assert do("SetPlaybackStopFrame", 70) == done
    assert (playback.index, playback.first, playback.last) == (60, 60, 70)
    assert do("SetPlaybackLooping", 1) == done
    assert playback.at_end is AtEnd.LOOP
    assert do("SetPlaybackSpeed", 2.5) == done
    assert playback.speed == 2.5
    assert do("SetPlaybackCurrentFrame", "soon") == failed
    assert do("SetPlaybackSpeed", "nan") == failed
    assert do("SetPlaybackCurrentFrame") == failed
    assert do("StartRecording") == failed
    assert do("FrameRate") == Response.of_float32(60.0)
    assert do("UnitsToMillimeters") == Response.of_float32(1000.0)
    assert do("CurrentMode") == Response.of_int32(2)
    assert do("CurrentTakeLength") == Response.of_int32(100)
    assert isinstance(do("TestRequest"), UnrecognizedRequest)
