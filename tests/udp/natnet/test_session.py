"""The client's side of a connection: over a network in memory, and over a recorded session of Motive 2.1."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import ConnectionFailedError
from retarget.udp.natnet import requests
from retarget.udp.natnet.codec import encode
from retarget.udp.natnet.messages import Disconnect, DisconnectByTimeout, MessageId, Response, Sender, ServerInfo
from retarget.udp.natnet.records import FrameFlag
from retarget.udp.natnet.session import NatNetSession, Phase
from retarget.udp.natnet.version import Bitstream
from tests.udp.natnet.captures import needs_captures, of_session
from tests.udp.natnet.captures import session as captured
from tests.udp.natnet.distortions import DISTORTIONS
from tests.udp.natnet.examples import every_command, rich_frame, rich_models
from tests.udp.natnet.wire import CLIENT, NAMES, Wire, responder

if TYPE_CHECKING:
    from retarget.frames import MarkerFrame

V30, V41, V42 = Bitstream(3, 0), Bitstream(4, 1), Bitstream(4, 2)
CONNECT, MODELDEF, ECHO = MessageId.CONNECT, MessageId.REQUEST_MODELDEF, MessageId.ECHOREQUEST


def _connected(bitstream: Bitstream = V41) -> Wire:
    wire = Wire(NatNetSession(), responder(bitstream))
    wire.run(0.6)
    return wire


def test_a_connection_learns_version_names_rate_unit_and_clock() -> None:
    wire = _connected()
    assert wire.session.ready(wire.now_s)
    assert wire.session.bitstream == V41
    assert wire.session.layout.names == NAMES
    assert wire.session.rate_hz == pytest.approx(100.0)
    assert wire.session.clock is not None
    assert wire.session.clock.best_round_trip_s == pytest.approx(0.0004)
    frame = wire.play(5)
    assert frame is not None
    assert frame.positions[0] == pytest.approx([0.005, 0.015, 0.025])
    assert frame.time_s == pytest.approx(wire.now_s - 0.001, abs=1e-6)
    assert frame.time_s < frame.received_s


@pytest.mark.parametrize(
    ("server", "wanted", "agreed"),
    [(V42, V41, V41), (V41, V42, V41), (V30, V41, V30), (Bitstream(2, 9), V41, Bitstream(2, 9))],
)
def test_both_ends_agree_on_a_bitstream(server: Bitstream, wanted: Bitstream, agreed: Bitstream) -> None:
    wire = Wire(NatNetSession(wanted=wanted), responder(server))
    wire.run(0.6)
    assert wire.session.bitstream == agreed
    assert wire.play(1) is not None


@pytest.mark.parametrize("seed", range(8))
def test_a_network_that_loses_every_other_datagram_only_delays_the_connection(seed: int) -> None:
    rng = random.Random(seed)
    wire = Wire(NatNetSession(), responder(V41), loses=lambda _: rng.random() < 0.5)
    wire.run(40.0)
    assert wire.session.phase is Phase.CONNECTED
    assert wire.session.layout.names == NAMES
    assert wire.session.bitstream == V41


def test_an_answer_that_was_too_late_is_not_taken_for_the_next_one() -> None:
    """The server's 1000 mm must not become the frame rate, nor its 100 Hz the unit."""
    wire = Wire(NatNetSession(), responder(V41), loses=lambda d: d[:2] == b"\3\0")
    wire.run(3.0)
    wire.loses = lambda _: False
    wire.session.receive(b"\3\0\4\0" + np.float32(7.0).tobytes(), wire.now_s)
    assert wire.session.rate_hz is None
    frame = wire.play(5)
    assert frame is not None
    assert frame.positions[0] == pytest.approx([0.005, 0.015, 0.025])


def test_silence_connects_again_and_frames_go_on() -> None:
    wire = _connected()
    wire.play(1)
    wire.server, server = None, wire.server
    wire.run(6.0)
    assert wire.count(CONNECT) >= 4
    wire.server = server
    wire.run(1.5)
    assert wire.play(2) is not None
    assert wire.session.reconnects == 1
    assert wire.session.framing.lost == 0


def test_a_paused_server_is_not_asked_faster_and_faster() -> None:
    wire = _connected()
    before = len(wire.asked)
    wire.run(60.0)
    assert wire.session.phase is Phase.CONNECTED
    assert len(wire.asked) - before < 60 * 2.5
    assert wire.play(1) is not None


def test_a_restarted_server_with_another_version_and_other_markers_is_followed() -> None:
    wire = _connected()
    for number in range(500, 510):
        wire.play(number)
    wire.server = responder(V30, ("jaw", "lip"))
    wire.run(4.0)
    frame = wire.play(0)
    assert wire.session.bitstream == V30
    assert frame is not None
    assert frame.layout.names == ("jaw", "lip")
    assert wire.session.framing.lost == 0


def test_definitions_are_asked_for_again_when_a_frame_says_that_they_changed() -> None:
    wire = _connected()
    wire.play(1)
    wire.run(0.2)
    asked = wire.count(MODELDEF)
    for number in range(2, 6):
        wire.play(number, flags=FrameFlag.MODELS_CHANGED)
        wire.run(0.2)
    assert wire.count(MODELDEF) == asked + 1


def test_definitions_are_asked_for_again_when_a_frame_shows_it() -> None:
    wire = _connected()
    for number in range(12):
        wire.play(number)
        wire.run(0.5)
    changed = responder(V41, (*NAMES, "ear"))
    assert wire.server is not None
    changed.clients = wire.server.clients
    wire.server = changed
    wire.play(12)
    wire.run(0.2)
    frame = wire.play(13)
    assert frame is not None
    assert frame.layout.names == (*NAMES, "ear")


def test_a_changed_bitstream_is_announced_and_leads_to_a_new_handshake() -> None:
    wire = _connected(V42)
    asked = wire.count(CONNECT)
    wire.play(1, flags=FrameFlag.BITSTREAM_CHANGED)
    wire.run(0.2)
    assert wire.count(CONNECT) == asked + 1
    assert wire.session.reconnects == 1


def test_frames_of_another_version_than_announced_are_read_if_one_fits() -> None:
    """A server may say 4.1 and still send what was asked for."""
    wire = Wire(NatNetSession(wanted=V30), None)
    wire.session.receive(encode(ServerInfo(Sender.named("Motive", (3, 0, 0, 0), (4, 1, 0, 0)))), wire.now_s)
    wire.server = responder(V30)
    wire.session.receive(wire.server.definitions(V30), wire.now_s)
    assert wire.play(1) is not None
    assert wire.session.bitstream == V30
    assert wire.session.malformed == 0


def test_frames_that_make_no_sense_are_counted_and_lead_to_a_new_handshake() -> None:
    wire = _connected()
    for _ in range(20):
        assert wire.session.receive(b"\7\0\4\0garbage", wire.now_s) is None
    wire.run(0.2)
    assert wire.session.malformed == 20
    assert wire.session.reconnects == 1
    assert wire.play(1) is not None


def test_the_end_is_told() -> None:
    wire = _connected()
    wire.session.receive(encode(Disconnect()), wire.now_s)
    assert wire.session.phase is Phase.ENDED
    assert wire.session.due(wire.now_s + 10) == []


def test_a_client_that_was_given_up_connects_again_at_once() -> None:
    wire = _connected()
    asked = wire.count(CONNECT)
    wire.session.receive(encode(DisconnectByTimeout()), wire.now_s)
    wire.run(0.01)
    assert wire.count(CONNECT) == asked + 1


def test_doubled_and_late_frames_are_counted_and_not_handed_on() -> None:
    wire = _connected()
    numbers = [1, 2, 2, 5, 4, 6]
    handed_on = [frame.number for frame in map(wire.play, numbers) if frame is not None]
    framing = wire.session.framing
    assert handed_on == [1, 2, 5, 6]
    assert (framing.delivered, framing.doubled, framing.late, framing.lost) == (4, 1, 1, 1)


def test_times_never_go_back_while_the_clock_learns() -> None:
    wire = _connected()
    times_s = []
    for number in range(200):
        frame = wire.play(number)
        assert frame is not None
        times_s.append(frame.time_s)
        wire.run(0.01)
    assert np.all(np.diff(times_s) > 0)
    assert np.diff(times_s) == pytest.approx(0.01, abs=1e-6)


def test_a_version_too_old_to_be_read_is_refused_with_a_word() -> None:
    info = encode(ServerInfo(Sender.named("Tracking Tools", (2, 0, 0, 0), (2, 0, 0, 0))))
    with pytest.raises(ConnectionFailedError, match=r"2\.0, which is too old"):
        NatNetSession().receive(info, 1.0)


def test_a_unit_of_millimetres_becomes_metres(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(requests._FACTS, "UnitsToMillimeters", Response.of_float32(1.0))
    frame = _connected().play(5)
    assert frame is not None
    assert frame.positions[0] == pytest.approx([5e-6, 15e-6, 25e-6])


def _recorded_frames() -> list[MarkerFrame]:
    """The recorded session once more: 0.01 s from datagram to datagram."""
    session = NatNetSession("recorded")
    frames = []
    for index, datagram in enumerate(captured()):
        at_s = 100.0 + index / 100
        session.sent(datagram, at_s)
        frame = session.receive(datagram, at_s)
        if frame is not None:
            frames.append(frame)
    return frames


@needs_captures
def test_the_recorded_session_gives_every_frame_from_the_definitions_on_named_and_in_order() -> None:
    frames = _recorded_frames()
    came_before = sum(1 for d in captured()[: captured().index(of_session(MessageId.MODELDEF)[0])] if d[0] == 7)
    assert [frame.number for frame in frames] == list(range(162_734 + came_before, 163_252))
    assert frames[-1].layout.names == ("Marker1", "Marker2", "Marker3", "Marker4", "Marker5")
    assert np.isfinite(frames[-1].positions).all()


@needs_captures
def test_the_same_datagrams_give_the_same_frames_to_the_last_bit() -> None:
    for first, second in zip(_recorded_frames(), _recorded_frames(), strict=True):
        assert (first.number, first.time_s, first.received_s) == (second.number, second.time_s, second.received_s)
        assert first.positions.tobytes() == second.positions.tobytes()


@pytest.mark.parametrize("version", [Bitstream(2, 9), V30, V41], ids=str)
def test_whatever_arrives_neither_end_fails_and_the_stream_goes_on(version: Bitstream) -> None:
    rng = random.Random(3)
    wire = _connected(version)
    assert wire.server is not None
    valid = [encode(m) for m in every_command() if not isinstance(m, Disconnect)]
    valid += [encode(rich_frame(version), version), encode(rich_models(version), version)]
    valid.append(wire.server.definitions(version))
    for number in range(3000):
        bent = rng.choice(DISTORTIONS)(rng, rng.choice(valid))
        if bent[:2] == bytes([MessageId.DISCONNECT, 0]):
            continue
        wire.session.receive(bent, wire.now_s)
        wire.session.sent(bent, wire.now_s)
        wire.server.answer(bent, CLIENT, wire.now_s)
        if number % 100 == 0:
            wire.run(0.01)
    wire.server = responder(version)
    wire.run(30.0)
    frame = wire.play(1_000_000)
    assert wire.session.phase is Phase.CONNECTED
    assert frame is not None
    assert frame.layout.names == NAMES
