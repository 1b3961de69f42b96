"""UDP sockets on loopback: what they carry, when they say it came, and how their mistakes are told."""

from __future__ import annotations

import time

import pytest

from retarget.errors import ConnectionFailedError
from retarget.udp.sockets import (
    LOOPBACK,
    MAX_DATAGRAM,
    Received,
    UdpSocket,
    broadcast_address,
    local_address_towards,
    open_broadcast,
    open_broadcast_receiver,
    open_multicast_receiver,
    open_multicast_sender,
    open_udp,
    resolve,
    wait_readable,
)

GROUP = "239.255.77.3"


def _next(receiver: UdpSocket) -> Received:
    assert wait_readable([receiver], 5.0) == [receiver.fileno()]
    received = receiver.receive()
    assert received is not None
    return received


def test_a_datagram_arrives_with_its_sender_and_its_time() -> None:
    with open_udp() as here, open_udp() as there:
        before_s = time.monotonic()
        assert here.send(b"hello", there.address)
        after_s = time.monotonic()
        time.sleep(0.05)
        received = _next(there)
        assert (received.payload, received.peer) == (b"hello", here.address)
        assert before_s - 1e-3 <= received.received_s <= after_s + 1e-3  # the kernel's time, not that of reading it


def test_nothing_binds_beyond_loopback_unless_told() -> None:
    with open_udp() as here:
        assert here.address[0] == LOOPBACK


def test_an_empty_socket_does_not_block() -> None:
    with open_udp() as here:
        assert here.receive() is None
        assert wait_readable([here], 0.0) == []


def test_the_largest_datagram_fits() -> None:
    with open_udp() as here, open_udp() as there:
        assert here.send(bytes(65_507), there.address)
        assert len(_next(there).payload) == 65_507 < MAX_DATAGRAM


def test_a_peer_that_is_gone_is_no_error() -> None:
    with open_udp() as gone:
        address = gone.address
    with open_udp() as here:
        here.send(b"anybody?", address)
        here.send(b"anybody?", address)
        assert here.receive() is None


def test_what_the_kernel_throws_away_is_counted() -> None:
    with open_udp() as here, open_udp() as there:
        for _ in range(400):
            here.send(bytes(65_000), there.address)
        while there.receive() is not None:
            pass
        here.send(b"after", there.address)
        _next(there)
        assert there.overflowed > 0


@pytest.mark.parametrize(
    ("host", "word"),
    [(LOOPBACK, "is in use"), ("203.0.113.9", "not an address of this machine")],
)
def test_an_address_that_cannot_be_used_is_told_in_one_sentence(host: str, word: str) -> None:
    with open_udp() as taken, pytest.raises(ConnectionFailedError) as error:
        open_udp(host, taken.address[1])
    assert word in str(error.value)
    assert str(error.value).count("\n") == 0


def test_multicast_stays_on_loopback_and_reaches_everybody_who_joined() -> None:
    with open_multicast_receiver(GROUP, 0, LOOPBACK) as first:
        port = first.address[1]
        with open_multicast_receiver(GROUP, port, LOOPBACK) as second, open_multicast_sender(LOOPBACK) as sender:
            assert sender.send(b"frame", (GROUP, port))
            assert _next(first).payload == _next(second).payload == b"frame"


def test_what_is_no_group_cannot_be_joined() -> None:
    with pytest.raises(ConnectionFailedError, match="not a multicast group"):
        open_multicast_receiver("192.168.1.5", 0, LOOPBACK)
    with pytest.raises(ConnectionFailedError, match="on the interface 203"):
        open_multicast_receiver(GROUP, 0, "203.0.113.9")


def test_a_broadcast_is_heard_by_all_who_listen_for_it() -> None:
    with open_udp() as free:
        port = free.address[1]
    with open_broadcast_receiver(LOOPBACK, port) as first, open_broadcast_receiver(LOOPBACK, port) as second:
        with open_broadcast(LOOPBACK) as asking:
            assert asking.send(b"who?", (broadcast_address(LOOPBACK), port))
        assert _next(first).payload == _next(second).payload == b"who?"


def test_names_are_resolved_and_unknown_ones_told() -> None:
    assert resolve("127.0.0.1") == resolve("localhost") == LOOPBACK
    with pytest.raises(ConnectionFailedError, match="is not known"):
        resolve("no such host.invalid")


def test_loopback_is_reached_from_loopback() -> None:
    assert local_address_towards(LOOPBACK) == LOOPBACK
