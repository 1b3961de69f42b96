"""A live stream on loopback into a source: all frames, nothing foreign, and every way it can end."""

from __future__ import annotations

import signal
import threading
import time
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import ConnectionFailedError, InputError
from retarget.udp.natnet import clients, link
from retarget.udp.natnet.messages import MessageId
from retarget.udp.natnet.playback import AtEnd
from retarget.udp.natnet.player import Begin, Player
from retarget.udp.natnet.source import NatNetSource
from retarget.udp.natnet.version import Bitstream
from retarget.udp.sockets import open_udp
from tests.udp.natnet.live import GROUP, assert_same_markers, free_group_port, serve, take, until, url

if TYPE_CHECKING:
    from retarget.udp.datagram import Datagram

BITSTREAMS = [Bitstream(2, 9), Bitstream(3, 0), Bitstream(4, 1), Bitstream(4, 2)]


@pytest.mark.parametrize("bitstream", BITSTREAMS, ids=str)
def test_every_frame_arrives_named_and_the_iteration_ends_with_the_take(bitstream: Bitstream) -> None:
    frames = take()
    with serve(frames, bitstream=bitstream) as server, NatNetSource(url(server)) as source:
        received = list(source)
        assert_same_markers(received, frames)
        assert source.stats.received == len(frames)
        assert source.stats.lost == 0
        assert source.rate_hz == pytest.approx(240.0)


def test_times_are_those_of_the_exposure_on_the_local_clock() -> None:
    with serve(take()) as server, NatNetSource(url(server)) as source:
        received = list(source)
    steps_s = np.diff([frame.time_s for frame in received])
    assert np.median(steps_s) == pytest.approx(1 / 240, abs=2e-4)
    assert all(frame.time_s <= frame.received_s for frame in received)


def test_multicast_is_joined_where_the_server_announces_it() -> None:
    frames, port = take(), free_group_port()
    with serve(frames, multicast=GROUP, data_port=port) as server, NatNetSource(url(server)) as source:
        assert_same_markers(list(source), frames)
        assert server.datagrams_unsent == 0


def test_a_group_can_be_named() -> None:
    frames, port = take(), free_group_port()
    options = f"?multicast={GROUP}&data_port={port}&local=127.0.0.1"
    with (
        serve(frames, multicast=GROUP, data_port=port, bitstream=Bitstream(2, 9)) as server,
        NatNetSource(url(server, options)) as source,
    ):
        assert_same_markers(list(source), frames)


def test_nobody_answering_is_told_with_what_to_check() -> None:
    with open_udp() as deaf:
        port = deaf.address[1]
        with (
            pytest.raises(ConnectionFailedError) as error,
            NatNetSource(f"natnet://127.0.0.1:{port}", patience_s=0.3),
        ):
            pass
    for word in ("127.0.0.1", str(port), "streaming", "firewall", "interface"):
        assert word in str(error.value)


def test_an_unreadable_address_is_told_before_anything_is_opened() -> None:
    with pytest.raises(InputError, match="not the address"):
        NatNetSource("http://127.0.0.1")


def test_garbage_and_strangers_are_counted_and_the_stream_goes_on() -> None:
    frames = take(120)
    with serve(frames) as server, NatNetSource(url(server)) as source, open_udp() as stranger:
        assert source._link is not None
        client = source._link._sockets["command"].address
        received = []
        for frame in source:
            received.append(frame)
            if frame.number == 20:
                for octets in (b"", b"\7\0\0\0", b"\x09\0\0\0", b"hello there"):
                    stranger.send(octets, client)
                server._commands.send(b"\7\0\4\0junk", client)
                server._commands.send(b"\x0d\0\4\0junk", client)
        assert_same_markers(received, frames)
        assert source.stats.foreign >= 3  # a frame may come from any port of the server's address
        assert source.stats.malformed == 3
        assert source.stats.lost == 0


def test_a_reader_that_lags_gets_the_newest_frames_and_the_count_of_the_others() -> None:
    frames = take(400, rate_hz=2000.0)
    with serve(frames) as server, NatNetSource(url(server), queue_frames=50) as source:
        server.wait(30.0)
        until(lambda: source._link is not None and source._link._inbox._waiting.qsize() >= 50)
        received = list(source)
        assert 40 <= len(received) <= 50
        assert received[-1].number == 399
        stats = source.stats
        assert stats.dropped > 300
        assert stats.received + stats.dropped + stats.lost >= 399


def test_the_tap_has_both_directions_and_all_frames() -> None:
    frames, tapped = take(), list["Datagram"]()
    with serve(frames) as server, NatNetSource(url(server), tap=tapped.append, queue_frames=10) as source:
        server.wait(30.0)
        list(source)
        peers = {datagram.peer for datagram in tapped}
        assert peers == {server.address}
    kinds = [(d.direction, d.channel, MessageId(int.from_bytes(d.payload[:2], "little"))) for d in tapped]
    assert kinds.count(("in", "data", MessageId.FRAMEOFDATA)) == len(frames)
    for wanted in (
        ("out", "command", MessageId.CONNECT),
        ("in", "command", MessageId.SERVERINFO),
        ("out", "command", MessageId.REQUEST_MODELDEF),
        ("in", "command", MessageId.MODELDEF),
        ("in", "command", MessageId.ECHORESPONSE),
        ("out", "command", MessageId.DISCONNECT),
    ):
        assert wanted in kinds


def test_a_restarted_server_is_found_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Player, "_take_leave", lambda _: None)  # it crashes, and says nothing
    with serve(take(20)) as server, NatNetSource(url(server)) as source:
        assert next(source).number == 0
        server.close()
        monkeypatch.undo()
        with serve(take(30, markers=5), command_port=source._opened().server[1], bitstream=Bitstream(3, 0)):
            received = list(source)
        assert received[-1].number == 29
        assert len(received[-1].layout.names) == 5
        assert source.stats.reconnects == 1


def test_the_iteration_can_be_stopped_from_another_thread() -> None:
    with serve(take(), at_end=AtEnd.LOOP, begin=Begin.AT_ONCE) as server, NatNetSource(url(server)) as source:
        threading.Timer(0.2, source.stop).start()
        assert sum(1 for _ in source) > 0


def test_the_iteration_can_be_stopped_from_a_signal() -> None:
    with serve(take(), at_end=AtEnd.LOOP, begin=Begin.AT_ONCE) as server, NatNetSource(url(server)) as source:
        previous = signal.signal(signal.SIGALRM, lambda *_: source.stop())
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.2)
            assert sum(1 for _ in source) > 0
        finally:
            signal.signal(signal.SIGALRM, previous)


def test_a_client_that_stalls_stays_connected(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep-alives do not wait for the reader."""
    monkeypatch.setattr(clients, "SILENCE_S", 0.4)
    monkeypatch.setattr(link, "_KEEP_ALIVE_S", 0.1)
    with serve(take(), at_end=AtEnd.LOOP, begin=Begin.AT_ONCE) as server, NatNetSource(url(server)) as source:
        next(source)
        time.sleep(1.2)
        assert server.clients == 1
        assert source.stats.reconnects == 0


def test_leaving_is_told_to_the_server() -> None:
    with serve(take(), at_end=AtEnd.LOOP) as server:
        with NatNetSource(url(server)) as source:
            next(source)
            assert server.clients == 1
        until(lambda: server.clients == 0)
