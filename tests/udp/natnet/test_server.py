"""A live server on loopback and several clients."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import ezc3d
import numpy as np
import pytest

from retarget.errors import ConnectionFailedError, InputError
from retarget.frames import MarkerFrame, MarkerLayout
from retarget.udp.natnet import clients, player
from retarget.udp.natnet.client import NatNetClient
from retarget.udp.natnet.codec import encode
from retarget.udp.natnet.messages import Connect, MessageId
from retarget.udp.natnet.pacing import FastestPace, SteadyPace
from retarget.udp.natnet.playback import AtEnd
from retarget.udp.natnet.player import Begin
from retarget.udp.natnet.source import NatNetSource
from retarget.udp.natnet.version import Bitstream
from retarget.udp.sockets import open_udp, wait_readable
from tests.udp.natnet.live import assert_same_markers, serve, take, until, url

JAW = Path(__file__).parents[3] / "../shared/data/animface/jaw.c3d"


def test_several_clients_get_every_frame_each_in_its_own_bitstream() -> None:
    frames = take(120)
    received: dict[str, list[MarkerFrame]] = {}
    with serve(frames, bitstream=Bitstream(4, 2), begin=Begin.AT_ONCE, at_end=AtEnd.LOOP) as server:

        def watch(bitstream: str) -> None:
            with NatNetSource(url(server, f"?bitstream={bitstream}")) as source:
                received[bitstream] = [frame for frame, _ in zip(source, range(100), strict=False)]
                assert str(source.session.bitstream) == bitstream

        watchers = [threading.Thread(target=watch, args=(b,)) for b in ("2.9", "3.0", "3.1", "4.1", "4.2")]
        for watcher in watchers:
            watcher.start()
        for watcher in watchers:
            watcher.join()
    assert len(received) == 5
    for frames_received in received.values():
        assert_same_markers(frames_received, [frames[frame.number] for frame in frames_received])


def test_a_client_that_vanishes_is_dropped_and_the_others_notice_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients, "UNPROVEN_S", 0.3)
    frames = take(240)
    with serve(frames) as server, NatNetSource(url(server)) as source, open_udp() as vanishing:
        vanishing.send(encode(Connect()), server.address)
        until(lambda: server.clients == 2)
        assert_same_markers(list(source), frames)
        assert source.stats.lost == 0
        assert server.clients == 1


def test_a_client_that_never_reads_disturbs_nobody() -> None:
    frames = take(400, rate_hz=1000.0)
    with open_udp() as deaf, serve(frames) as server, NatNetSource(url(server)) as source:
        deaf.send(encode(Connect()), server.address)
        assert_same_markers(list(source), frames)


def test_a_take_begins_with_its_first_frame_however_late_the_client_comes() -> None:
    frames = take(20)
    with serve(frames) as server:
        time.sleep(0.3)
        assert server.frames_sent == 0
        with NatNetSource(url(server)) as source:
            assert next(source).number == 0


def test_a_client_that_never_asks_for_definitions_gets_frames_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(player, "_GRACE_S", 0.2)
    with serve(take(20)) as server, open_udp() as client:
        client.send(encode(Connect()), server.address)
        first_frame = b""
        while first_frame[:2] != bytes([MessageId.FRAMEOFDATA, 0]):
            assert wait_readable([client], 5.0)
            received = client.receive()
            first_frame = received.payload if received is not None else b""


def test_a_port_in_use_is_told_in_one_sentence() -> None:
    with serve(take(2)) as server, pytest.raises(ConnectionFailedError, match="in use"):
        serve(take(2), command_port=server.address[1])


def test_a_speed_that_cannot_be_played_is_refused_and_leaves_no_port_open() -> None:
    with pytest.raises(InputError, match="speed"):
        serve(take(2), speed=-1.0)


@pytest.mark.parametrize(("speed", "pace"), [(4.0, None), (1.0, SteadyPace(480.0))])
def test_speed_and_rate_change_the_time_between_frames(speed: float, pace: SteadyPace | None) -> None:
    settings = {} if pace is None else {"pace": pace}
    with serve(take(100, rate_hz=120.0), speed=speed, **settings) as server, NatNetSource(url(server)) as source:
        received = list(source)
        assert source.rate_hz == pytest.approx(480.0)
    steps_s = np.diff([frame.time_s for frame in received])
    assert np.median(steps_s) == pytest.approx(1 / 480, abs=2e-4)


def test_as_fast_as_possible_still_sends_every_frame_once() -> None:
    with serve(take(300), pace=FastestPace()) as server, NatNetSource(url(server)) as source:
        assert [frame.number for frame in source] == list(range(300))


def test_playback_is_controlled_over_the_network() -> None:
    frames = take(200)
    with (
        serve(frames, at_end=AtEnd.LOOP) as server,
        NatNetSource(url(server)) as source,
        NatNetClient(*server.address) as remote,
    ):
        next(source)
        remote.pause()
        until(lambda: _stands_still(source))
        assert remote.frame_rate_hz() == pytest.approx(240.0)
        remote.play_range(50, 59)
        remote.jump(55)
        remote.play()
        numbers = [frame.number for frame, _ in zip(source, range(20), strict=False)]
        assert numbers[:5] == [55, 56, 57, 58, 59]
        assert numbers[5:15] == list(range(50, 60))
        assert source.stats.lost <= 200


@pytest.mark.skipif(not JAW.exists(), reason=f"the real take is not at {JAW}")
def test_the_real_jaw_take_loses_no_frame_at_twenty_times_its_speed() -> None:
    recorded = ezc3d.c3d(str(JAW))
    positions = 1e-3 * np.moveaxis(recorded["data"]["points"][:3], 0, -1).swapaxes(0, 1)
    layout = MarkerLayout("jaw", tuple(recorded["parameters"]["POINT"]["LABELS"]["value"]))
    frames = [MarkerFrame(i, i / 60, i / 60, layout, positions[i]) for i in range(len(positions))]
    with serve(frames, speed=20.0) as server, NatNetSource(url(server)) as source:
        assert_same_markers(list(source), frames)
        assert len(frames) == 1590
        assert source.stats.lost == source.stats.dropped == 0


def _stands_still(source: NatNetSource) -> bool:
    """Whether no frame waits and none comes for a while; takes those that wait."""
    assert source._link is not None
    arrival = source._link.receive(0.1)
    if arrival is not None:
        source._session.receive(arrival.payload, arrival.received_s)
    return arrival is None


def test_a_flood_of_connects_leaves_the_stream_alone() -> None:
    frames = take(240)
    with serve(frames) as server, NatNetSource(url(server)) as source:
        first = next(source)
        flood = [open_udp() for _ in range(150)]
        for each in flood:
            each.send(encode(Connect()), server.address)
        assert_same_markers([first, *source], frames)
        assert server.clients <= 32
        for each in flood:
            each.close()
