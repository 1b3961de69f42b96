"""A NatNet stream over loopback: what a frame costs, what is lost, how late it is and how true its time.

The stream is the real jaw take at four times its speed where it lies beside the project, and made-up markers elsewhere.
"""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from retarget.frames import MarkerFrame, MarkerLayout
from retarget.udp.natnet.codec import encode
from retarget.udp.natnet.framedata import Ticks
from retarget.udp.natnet.messages import Connect, KeepAlive
from retarget.udp.natnet.pacing import FastestPace, SteadyPace
from retarget.udp.natnet.reel import MarkerReel
from retarget.udp.natnet.server import NatNetServer, ServerSettings
from retarget.udp.natnet.session import NatNetSession
from retarget.udp.natnet.source import NatNetSource
from retarget.udp.natnet.version import Bitstream
from tests.benchmarks.report import Row, seconds_per_call
from tests.udp.natnet.live import take, url
from tests.udp.natnet.wire import CLOCK_HZ, Wire, responder

if TYPE_CHECKING:
    from collections.abc import Iterator

JAW = Path(__file__).parents[2] / "../shared/data/animface/jaw.c3d"
FACE24 = tuple(f"marker{i:02}" for i in range(24))
V41 = Bitstream(4, 1)


def rows() -> Iterator[Row]:
    """All of it takes about half a minute."""
    yield from _cost_of_a_frame()
    yield from _stream_of_the_jaw()
    yield from _many_servers()
    yield from _as_fast_as_possible()
    yield from _keep_alives()


def _cost_of_a_frame() -> Iterator[Row]:
    wire = Wire(NatNetSession(), responder(V41, FACE24))
    wire.run(1.0)
    assert wire.server is not None
    frame = wire.server.reel.frame(1)
    number, clock = 0, int(wire.now_s * CLOCK_HZ)

    def datagram() -> bytes:
        nonlocal number
        number += 1
        return encode(replace(frame, number=number, ticks=Ticks(clock + number, 1, clock + number)), V41)

    encoding_s = seconds_per_call(datagram, 1000)
    waiting = iter([datagram() for _ in range(1100)])
    receiving_s = seconds_per_call(lambda: wire.session.receive(next(waiting), wire.now_s), 1000)
    peer = _natnet_decode(datagram())
    yield Row("24 markers, 4.1: datagram to named and timed frame", 1e6 * receiving_s, "us", *peer)
    yield Row("24 markers, 4.1: frame to datagram", 1e6 * encoding_s, "us")


def _natnet_decode(datagram: bytes) -> tuple[str, float | None]:
    """What a peer takes for the decoding alone [us]."""
    try:
        from tests.udp.natnet.peers import natnet_frame

        return "natnet 0.3.0, decoding alone", 1e6 * seconds_per_call(lambda: natnet_frame(datagram, (4, 1)))
    except ImportError:
        return "", None


def _stream_of_the_jaw() -> Iterator[Row]:
    frames = _jaw()
    settings = ServerSettings(command_port=0, speed=4.0)
    with NatNetServer(MarkerReel(frames), settings) as server, NatNetSource(url(server)) as source:
        arrived = [(frame, time.monotonic()) for frame in source]
        stats, clock = source.stats, source.session.clock
    waits_ms = 1e3 * np.array([taken_s - frame.received_s for frame, taken_s in arrived])
    ages_ms = 1e3 * np.array([frame.received_s - frame.time_s for frame, _ in arrived])
    steps_us = 1e6 * np.diff([frame.time_s for frame, _ in arrived])
    name = f"{len(frames)} frames of {frames[0].positions.shape[0]} markers at 240 Hz"
    yield Row(f"{name}: lost", stats.lost + stats.dropped + len(frames) - len(arrived), "frames", aim="0")
    yield Row("kernel to frame, median", float(np.median(waits_ms)), "ms")
    yield Row("kernel to frame, 99 %", float(np.percentile(waits_ms, 99)), "ms")
    yield Row("exposure (server's due time) to kernel, median", float(np.median(ages_ms)), "ms")
    yield Row("jitter of arrival, standard deviation", 1e3 * float(np.std(ages_ms)), "us")
    yield Row("jitter of the frames' times, standard deviation", float(np.std(steps_us)), "us")
    if clock is not None:
        yield Row("quickest echo", 1e6 * clock.best_round_trip_s, "us")


def _jaw() -> list[MarkerFrame]:
    """The real take, metres; made-up markers where it is not there."""
    if not JAW.exists():
        return take(1590, 41, 60.0)
    import ezc3d

    recorded = ezc3d.c3d(str(JAW))
    positions = 1e-3 * np.moveaxis(recorded["data"]["points"][:3], 0, -1).swapaxes(0, 1)
    layout = MarkerLayout("jaw", tuple(recorded["parameters"]["POINT"]["LABELS"]["value"]))
    return [MarkerFrame(i, i / 60, i / 60, layout, positions[i]) for i in range(len(positions))]


def _many_servers() -> Iterator[Row]:
    """Four servers of 41 markers at 240 Hz into one process."""
    frames, lost = take(1200, 41, 240.0), list[int]()

    def watch(server: NatNetServer) -> None:
        with NatNetSource(url(server)) as source:
            received = sum(1 for _ in source)
            lost.append(len(frames) - received)

    settings = ServerSettings(command_port=0, pace=SteadyPace(240.0))
    servers = [NatNetServer(MarkerReel(frames), settings) for _ in range(4)]
    watchers = [threading.Thread(target=watch, args=(server,)) for server in servers]
    for watcher in watchers:
        watcher.start()
    for watcher in watchers:
        watcher.join()
    for server in servers:
        server.close()
    yield Row("4 servers of 41 markers at 240 Hz for 5 s, one process: lost", sum(lost), "frames", aim="0")


def _as_fast_as_possible() -> Iterator[Row]:
    frames = take(4000)
    settings = ServerSettings(command_port=0, pace=FastestPace())
    with NatNetServer(MarkerReel(frames), settings) as server, NatNetSource(url(server)) as source:
        next(source)
        start_s = time.perf_counter()
        count = sum(1 for _ in source)
        last_s = time.perf_counter() - 0.2  # the server waits before it takes leave
    yield Row("server and client in one process, as fast as possible", count / (last_s - start_s), "frames/s")
    yield Row("the same: lost", len(frames) - 1 - count, "frames", aim="0")


def _keep_alives() -> Iterator[Row]:
    """A client that sends one for each frame it gets, as some do."""
    server = responder(V41)
    server.answer(encode(Connect()), ("192.0.2.7", 40_000), 1.0)
    keep_alive = encode(KeepAlive(b"\0"))
    seconds = seconds_per_call(lambda: server.answer(keep_alive, ("192.0.2.7", 40_000), 2.0), 2000)
    yield Row("answering a keep-alive", 1e6 * seconds, "us")
