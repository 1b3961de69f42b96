"""The thread that receives, and the queue in which the newest frames win."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

import pytest

from retarget.udp.receiver import Arrival, Inbox, Receiver
from retarget.udp.sockets import UdpSocket, open_udp

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from retarget.udp.datagram import Datagram


def _frame(number: int) -> Arrival:
    return Arrival(b"f%d" % number, float(number), is_frame=True)


def _message(number: int) -> Arrival:
    return Arrival(b"m%d" % number, float(number), is_frame=False)


def _waiting(inbox: Inbox) -> list[bytes]:
    found = []
    while (arrival := inbox.get(0.0)) is not None:
        found.append(arrival.payload)
    return found


def _until(reached: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + 10.0
    while not reached():
        assert time.monotonic() < deadline_s
        time.sleep(0.005)


@pytest.fixture
def sockets() -> Iterator[tuple[UdpSocket, UdpSocket]]:
    with open_udp() as here, open_udp() as there:
        yield here, there


def test_what_waits_comes_out_in_order() -> None:
    inbox = Inbox(10)
    for i in range(5):
        inbox.put(_frame(i))
    assert _waiting(inbox) == [b"f0", b"f1", b"f2", b"f3", b"f4"]
    assert inbox.dropped == 0


def test_a_full_inbox_keeps_the_newest_frames_and_every_message() -> None:
    inbox = Inbox(4)
    for i in range(10):
        inbox.put(_message(i) if i in {1, 6} else _frame(i))
    assert _waiting(inbox) == [b"m1", b"m6", b"f7", b"f8", b"f9"]
    assert inbox.dropped == 5


def test_a_waiting_reader_is_let_go_when_the_inbox_closes() -> None:
    inbox = Inbox(4)
    threading.Timer(0.05, inbox.close).start()
    assert inbox.get(30.0) is None
    assert inbox.closed
    assert inbox.get(30.0) is None


def test_what_the_receiver_failed_with_is_raised_to_the_reader_after_what_came_before() -> None:
    inbox = Inbox(4)
    inbox.put(_frame(1))
    inbox.fail(OSError("disk full"))
    assert inbox.get(30.0) == _frame(1)
    for _ in range(2):
        with pytest.raises(OSError, match="disk full"):
            inbox.get(30.0)


def test_only_the_right_peer_is_handed_over_and_others_are_counted(sockets: tuple[UdpSocket, UdpSocket]) -> None:
    here, there = sockets
    inbox = Inbox(100)
    with open_udp() as stranger:
        receiver = Receiver(
            {"command": here}, inbox, accept=lambda _, received: received.peer == there.address, is_frame=lambda _: True
        )
        stranger.send(b"hello", here.address)
        there.send(b"frame", here.address)
        arrival = inbox.get(10.0)
        assert arrival is not None
        assert arrival.payload == b"frame"
        _until(lambda: receiver.foreign == 1)
        receiver.close()


def test_the_tap_sees_what_a_full_inbox_drops(sockets: tuple[UdpSocket, UdpSocket]) -> None:
    here, there = sockets
    inbox = Inbox(8)
    tapped: list[Datagram] = []
    receiver = Receiver(
        {"command": here},
        inbox,
        accept=lambda *_: True,
        is_frame=lambda payload: payload.startswith(b"f"),
        tap=tapped.append,
    )
    for i in range(100):
        there.send(b"f%d" % i, here.address)
    there.send(b"last", here.address)
    _until(lambda: len(tapped) == 101)
    receiver.close()
    assert [d.payload for d in tapped] == [*(b"f%d" % i for i in range(100)), b"last"]
    assert {(d.direction, d.peer) for d in tapped} == {("in", there.address)}
    assert [d.channel for d in tapped] == ["data"] * 100 + ["command"]
    assert inbox.dropped == 93
    assert _waiting(inbox) == [*(b"f%d" % i for i in range(93, 100)), b"last"]


def test_a_tap_that_fails_ends_the_stream_with_its_own_error(sockets: tuple[UdpSocket, UdpSocket]) -> None:
    here, there = sockets
    inbox = Inbox(8)

    def full_disk(_: Datagram) -> None:
        raise OSError("disk full")

    receiver = Receiver({"command": here}, inbox, accept=lambda *_: True, is_frame=lambda _: True, tap=full_disk)
    there.send(b"f", here.address)
    with pytest.raises(OSError, match="disk full"):
        inbox.get(10.0)
    receiver.close()


def test_the_beat_goes_on_without_any_datagram(sockets: tuple[UdpSocket, UdpSocket]) -> None:
    beats: list[float] = []
    receiver = Receiver(
        {"command": sockets[0]},
        Inbox(8),
        accept=lambda *_: True,
        is_frame=lambda _: True,
        beat=lambda: beats.append(time.monotonic()),
        beat_s=0.02,
    )
    _until(lambda: len(beats) >= 3)
    receiver.close()
