"""What the network says against a peer, and who is heard elsewhere; loopback only."""

from __future__ import annotations

import pytest

from retarget.errors import ConnectionFailedError
from retarget.udp.natnet.elsewhere import probe, who_answers, who_multicasts
from retarget.udp.sockets import LOOPBACK, Refusal, local_addresses, open_udp
from tests.udp.natnet.broken import BrokenServer, Script
from tests.udp.natnet.live import GROUP, free_group_port, serve, take


def test_a_port_that_nobody_has_is_refused() -> None:
    with open_udp() as free:
        address = free.address
    with probe(address, LOOPBACK) as asked:
        assert asked.refusal(2.0) is Refusal.PORT
        assert asked.refusal(0.0) is Refusal.PORT  # what was said stays said


def test_a_port_that_somebody_has_is_not_refused_whether_he_answers_or_not() -> None:
    with open_udp() as silent, probe(silent.address, LOOPBACK) as asked:
        assert asked.refusal(0.05) is None
        question = silent.receive()
        assert question is not None
        silent.send(b"answer", question.peer)
        assert asked.refusal(0.05) is None


def test_a_probe_makes_no_client() -> None:
    with serve(take(2)) as server, probe(server.address, LOOPBACK) as asked:
        assert asked.refusal(0.2) is None
        assert server.clients == 0


def test_a_probe_from_an_address_of_others_is_told() -> None:
    with pytest.raises(ConnectionFailedError, match="not an address of this machine"):
        probe((LOOPBACK, 9), "192.0.2.99")


def test_loopback_is_among_the_addresses_of_this_machine() -> None:
    assert LOOPBACK in local_addresses()


def test_the_server_itself_is_nobody_else() -> None:
    with serve(take(2)) as server:
        assert who_answers(server.address, LOOPBACK) == []


def test_only_frames_of_the_group_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("retarget.udp.natnet.elsewhere.local_addresses", lambda: [LOOPBACK, "192.0.2.99"])
    group = (GROUP, free_group_port())
    assert who_multicasts(group) == []
    with BrokenServer(Script(group=group, sends_to=group)) as server, open_udp() as client:
        host, _, port = server.url.removeprefix("natnet://").partition(":")
        client.send(bytes(4), (host, int(port)))
        heard = who_multicasts(group)
    assert [interface for interface, _ in heard] == [LOOPBACK]
    assert heard[0][1][0] == LOOPBACK
