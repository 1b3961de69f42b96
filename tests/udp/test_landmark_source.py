"""Frames over loopback, from the sink to the source."""

from __future__ import annotations

import itertools
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from retarget.errors import ConnectionFailedError, InputError
from retarget.frames import MarkerFrame, MarkerLayout
from retarget.udp.landmark_sink import LandmarkSink
from retarget.udp.landmark_source import LandmarkSource
from retarget.udp.sockets import open_udp

LAYOUT = MarkerLayout("mesh", tuple(f"mesh{i}" for i in range(478)))


def frames(count: int) -> list[MarkerFrame]:
    rng = np.random.default_rng(4)
    places = rng.normal(size=(count, 478, 3))
    places[:, 470:] = np.nan
    return [MarkerFrame(i, i / 30, i / 30, LAYOUT, place) for i, place in enumerate(places)]


def test_frames_arrive_with_names_numbers_gaps_and_confidence() -> None:
    sent = frames(20)
    with LandmarkSource("udp://127.0.0.1:0") as source, LandmarkSink(f"udp://:{source.address[1]}") as sink:
        for frame in sent:
            sink(frame, 0.5)
        received = list(itertools.islice(source, len(sent)))
        assert source.confidence == 0.5
        assert {what: count for what, count in source.counts().items() if count} == {"received": 20}
    assert [frame.number for frame in received] == list(range(20))
    assert received[0].layout.names == LAYOUT.names
    for ours, theirs in zip(received, sent, strict=True):
        np.testing.assert_allclose(ours.positions, theirs.positions, rtol=1e-7)


def test_times_are_the_senders_on_our_clock() -> None:
    with LandmarkSource("udp://127.0.0.1:0") as source, LandmarkSink(f"udp://:{source.address[1]}") as sink:
        sent_s = []
        for frame in frames(10):
            sent_s.append(time.monotonic())
            sink(replace(frame, time_s=sent_s[-1] - 1000.0))
            time.sleep(0.01)
        received = list(itertools.islice(source, 10))
    assert [frame.time_s for frame in received[1:]] == pytest.approx(sent_s[1:], abs=0.05)


def test_a_second_sender_does_not_mix_in() -> None:
    first, second = frames(2)
    with LandmarkSource("udp://127.0.0.1:0") as source:
        address = f"udp://127.0.0.1:{source.address[1]}"
        with LandmarkSink(address) as one, LandmarkSink(address) as other, open_udp() as stranger:
            one(first)
            stranger.send(b"hello", source.address)
            other(second)
            one(second)
            received = list(itertools.islice(source, 2))
        np.testing.assert_allclose(received[0].positions, first.positions, rtol=1e-7)
        assert source.counts()["foreign"] == 3


def test_a_source_that_is_stopped_ends() -> None:
    with LandmarkSource("udp://127.0.0.1:0") as source:
        threading.Timer(0.05, source.stop).start()
        assert list(source) == []


def test_a_sink_needs_no_listener() -> None:
    with open_udp() as taken:
        port = taken.address[1]
    with LandmarkSink(f"udp://127.0.0.1:{port}") as sink:
        for frame in frames(5):
            sink(frame)
        assert sink.sent + sink.refused == 5


def test_a_port_in_use_is_told() -> None:
    with (
        LandmarkSource("udp://127.0.0.1:0") as source,
        pytest.raises(ConnectionFailedError, match="in use"),
        LandmarkSource(f"udp://127.0.0.1:{source.address[1]}"),
    ):
        pass


@pytest.mark.parametrize("url", ["udp://", "tcp://127.0.0.1:1", "udp://127.0.0.1", "udp://h:99999", "udp://:1/path"])
def test_an_address_that_cannot_be_used_is_told_with_an_example(url: str) -> None:
    with pytest.raises(InputError, match=r"udp://HOST:PORT"):
        LandmarkSource(url)
