"""Commands to a live server, and finding it."""

from __future__ import annotations

import pytest

from retarget.errors import ConnectionFailedError, InputError
from retarget.udp.natnet.client import NatNetClient
from retarget.udp.natnet.discovery import discover, find_server
from retarget.udp.natnet.source import NatNetSource
from retarget.udp.natnet.version import Bitstream
from retarget.udp.sockets import LOOPBACK, open_udp
from tests.udp.natnet.live import assert_same_markers, serve, take


def test_questions_are_answered() -> None:
    with serve(take()) as server, NatNetClient(*server.address) as client:
        info = client.server_info()
        assert info.sender.name == "retarget"
        assert client.bitstream() == Bitstream(4, 1)
        assert client.frame_rate_hz() == pytest.approx(240.0)
        assert len(client.model_definitions().marker_sets[0].marker_names) == 24
        assert 0.0 < client.round_trip_s() < 1.0
        assert server.clients == 0


def test_what_a_replay_cannot_do_is_refused_with_a_word() -> None:
    with serve(take()) as server, NatNetClient(*server.address) as client:
        with pytest.raises(InputError, match="refused StartRecording"):
            client.start_recording()
        with pytest.raises(InputError, match="refused SetRecordTakeName"):
            client.set_record_take_name("ana_01")
        with pytest.raises(InputError, match="does not know the command Dance"):
            client.ask("Dance")


def test_nobody_answering_is_told() -> None:
    with (
        open_udp() as deaf,
        NatNetClient(*deaf.address, patience_s=0.2) as client,
        pytest.raises(ConnectionFailedError, match="does not answer FrameRate"),
    ):
        client.frame_rate_hz()


def test_answers_of_somebody_else_and_old_ones_do_not_count() -> None:
    with serve(take()) as server, NatNetClient(*server.address) as client, open_udp() as stranger:
        old = b"\3\0\4\0\0\0\0\0"
        stranger.send(old, client._socket.address)
        server._commands.send(old, client._socket.address)
        assert client.frame_rate_hz() == pytest.approx(240.0)


def test_servers_are_found_by_broadcast() -> None:
    frames = take(20)
    with serve(frames) as server:
        port = server.address[1]
        found = find_server(port, LOOPBACK)
        assert found.address == server.address
        with NatNetSource(f"natnet://:{port}?local=127.0.0.1") as source:
            assert_same_markers(list(source), frames)


def test_two_servers_are_listed_to_choose_from() -> None:
    with serve(take(2)) as first, serve(take(2), host="127.0.0.2", command_port=first.address[1]) as second:
        port = first.address[1]
        assert {found.address for found in discover(LOOPBACK, port)} == {first.address, second.address}
        with pytest.raises(InputError, match=r"Several NatNet servers answer: .*127\.0\.0\.2"):
            find_server(port, LOOPBACK)


def test_no_server_is_told_with_what_to_do() -> None:
    with open_udp() as deaf, pytest.raises(ConnectionFailedError, match="Name it, natnet://ADDRESS"):
        find_server(deaf.address[1], LOOPBACK)
