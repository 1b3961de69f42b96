"""OpenVHead's two ends over loopback; the Unity server and the Python client are stood in for by plain sockets."""

from __future__ import annotations

import itertools
import logging
import socket
import threading
import time
from typing import TYPE_CHECKING

import pytest

from retarget.errors import ConnectionFailedError
from retarget.udp.openvhead_message import OpenVHeadMessage, encode
from retarget.udp.openvhead_tcp import OpenVHeadClient, OpenVHeadServer
from retarget.udp.sockets import listen_tcp
from tests.udp.test_openvhead_message import recorded

if TYPE_CHECKING:
    from collections.abc import Callable

MESSAGE = OpenVHeadMessage(*[0.25] * 11)


def url(address: tuple[str, int]) -> str:
    return f"tcp://{address[0]}:{address[1]}"


def wait_for(true: Callable[[], bool], patience_s: float = 5.0) -> None:
    deadline_s = time.monotonic() + patience_s
    while not true():
        assert time.monotonic() < deadline_s, "it never came true"
        time.sleep(0.005)


def test_the_server_takes_what_openvheads_client_sends_one_after_the_other() -> None:
    texts = recorded()
    with OpenVHeadServer("tcp://127.0.0.1:0") as server:
        with socket.create_connection(server.address) as client:
            for text in texts:
                client.sendall(text.encode())
            arrived = list(itertools.islice(server, len(texts)))
        assert [encode(each.message).decode() for each in arrived] == texts
        assert server.malformed == 0


def test_the_server_takes_the_next_client_when_one_has_gone() -> None:
    with OpenVHeadServer("tcp://127.0.0.1:0") as server:
        for _ in range(2):
            with socket.create_connection(server.address) as client:
                client.sendall(encode(MESSAGE))
            assert next(iter(server)).message == MESSAGE


def test_a_message_that_is_none_is_passed_over_and_the_next_one_read() -> None:
    with OpenVHeadServer("tcp://127.0.0.1:0") as server, socket.create_connection(server.address) as client:
        client.sendall(b"this is not a message" * 40)
        messages = iter(server)
        threading.Timer(0.3, client.sendall, [encode(MESSAGE)]).start()
        assert next(messages).message == MESSAGE
        assert server.malformed == 1


def test_a_stopped_server_ends_its_iteration() -> None:
    with OpenVHeadServer("tcp://127.0.0.1:0") as server:
        threading.Timer(0.1, server.stop).start()
        assert list(server) == []


def test_a_port_in_use_is_told() -> None:
    with (
        OpenVHeadServer("tcp://127.0.0.1:0") as server,
        pytest.raises(ConnectionFailedError, match=r"port \d+ is in use"),
        OpenVHeadServer(url(server.address)),
    ):
        pass


def test_the_client_sends_what_the_unity_server_reads_at_once_as_one_message() -> None:
    with listen_tcp("127.0.0.1", 0) as unity, OpenVHeadClient(url(unity.address)) as client:
        assert client(MESSAGE)
        stream = unity.accept(1.0)
        assert stream is not None
        wait_for(lambda: (received := stream.receive()) is not None and received == encode(MESSAGE))
        stream.close()


def test_with_the_extension_a_newline_stands_behind_each_message() -> None:
    with OpenVHeadServer("tcp://127.0.0.1:0") as server, OpenVHeadClient(url(server.address), "newline") as client:
        for _ in range(50):
            client(MESSAGE)
        assert [each.message for each in itertools.islice(server, 50)] == [MESSAGE] * 50


def test_a_client_without_a_server_drops_says_so_once_and_connects_when_there_is_one(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with listen_tcp("127.0.0.1", 0) as taken:
        address = taken.address
    with OpenVHeadClient(url(address), retry_s=0.01) as client, caplog.at_level(logging.WARNING):
        for _ in range(5):
            assert not client(MESSAGE)
            time.sleep(0.02)
        assert client.dropped == 5
        assert len(caplog.records) == 1
        with OpenVHeadServer(url(address)) as server:
            wait_for(lambda: client(MESSAGE))
            assert next(iter(server)).message == MESSAGE


def test_a_client_notices_that_its_server_has_gone_and_finds_the_next() -> None:
    with OpenVHeadServer("tcp://127.0.0.1:0") as server:
        address = server.address
        client = OpenVHeadClient(url(address), retry_s=0.01)
        client(MESSAGE)
        next(iter(server))
    with client:
        wait_for(lambda: not client(MESSAGE))
        with OpenVHeadServer(url(address)) as again:
            wait_for(lambda: client(MESSAGE))
            assert next(iter(again)).message == MESSAGE


def test_a_server_that_does_not_read_does_not_hold_the_client_up_for_ever() -> None:
    with listen_tcp("127.0.0.1", 0) as deaf, OpenVHeadClient(url(deaf.address)) as client:
        client(MESSAGE)
        stream = deaf.accept(1.0)
        assert stream is not None
        with stream:
            for _ in range(1_000_000):
                if not client(MESSAGE):
                    break
        assert client.dropped == 1
