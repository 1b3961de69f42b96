"""Servers and clients on loopback, on ports of the kernel's choice."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from retarget.frames import MarkerFrame, MarkerLayout
from retarget.udp.natnet.reel import MarkerReel
from retarget.udp.natnet.server import NatNetServer, ServerSettings
from retarget.udp.sockets import LOOPBACK, open_multicast_receiver

if TYPE_CHECKING:
    from collections.abc import Callable

GROUP = "239.255.42.99"


def take(count: int = 60, markers: int = 24, rate_hz: float = 240.0) -> list[MarkerFrame]:
    """Markers that move at random and are not seen a tenth of the time, metres; the same each time."""
    rng = np.random.default_rng(11)
    layout = MarkerLayout("take", tuple(f"marker{i:02}" for i in range(markers)))
    positions = rng.normal(scale=0.1, size=(count, markers, 3))
    positions[rng.random((count, markers)) < 0.1] = np.nan
    return [MarkerFrame(i, i / rate_hz, i / rate_hz, layout, positions[i]) for i in range(count)]


def serve(frames: list[MarkerFrame], **settings: object) -> NatNetServer:
    """A server of these frames on a free port."""
    return NatNetServer(MarkerReel(frames), replace(ServerSettings(command_port=0), **settings))  # type: ignore[arg-type]


def url(server: NatNetServer, options: str = "") -> str:
    """Where it is."""
    return f"natnet://{server.address[0]}:{server.address[1]}{options}"


def free_group_port() -> int:
    """A port on which nobody listens to the group."""
    with open_multicast_receiver(GROUP, 0, LOOPBACK) as probe:
        return probe.address[1]


def until(reached: Callable[[], bool], patience_s: float = 10.0) -> None:
    """Wait for something that other threads do."""
    deadline_s = time.monotonic() + patience_s
    while not reached():
        assert time.monotonic() < deadline_s
        time.sleep(0.005)


def assert_same_markers(received: list[MarkerFrame], sent: list[MarkerFrame]) -> None:
    """All frames of `sent`, in order, seen where they were seen, to the precision of the wire."""
    assert [frame.number for frame in received] == [frame.number for frame in sent]
    for got, given in zip(received, sent, strict=True):
        assert got.layout.names == given.layout.names
        assert np.array_equal(got.positions.astype(np.float32), given.positions.astype(np.float32), equal_nan=True)
