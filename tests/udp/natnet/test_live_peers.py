"""Clients nobody here wrote receive the same markers from our server, over loopback."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.udp.natnet.framedata import FrameOfData, RigidBodies
from retarget.udp.natnet.models import DescribedMarkers, ModelDef, RigidBodyDescription
from retarget.udp.natnet.records import BODY
from retarget.udp.natnet.server import NatNetServer, ServerSettings
from retarget.udp.natnet.version import Bitstream
from tests.udp.natnet.live import GROUP, free_group_port, serve, take

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame

    Seen = dict[int, dict[str, list[float] | None]]

FRAMES = 60
UNICAST = [
    ("natnet", Bitstream(4, 1)),
    ("natnet", Bitstream(4, 2)),
    ("natnetsdk", Bitstream(4, 1)),
    ("optirx", Bitstream(2, 9)),
]


def _seen_by(name: str, server: NatNetServer, data_port: int = 0) -> Seen:
    module = name.split("_")[0]
    if importlib.util.find_spec(module) is None:
        pytest.skip(f"the peer {module} is not installed")
    command = [sys.executable, "-m", "tests.udp.natnet.peer_clients", name]
    numbers = [str(number) for number in (server.address[1], data_port, FRAMES - 1)]
    done = subprocess.run([*command, *numbers], capture_output=True, text=True, timeout=40, check=False)
    assert done.returncode == 0, done.stderr
    return {int(number): markers for number, markers in json.loads(done.stdout.splitlines()[-1]).items()}


def _assert_all_seen(seen: Seen, frames: list[MarkerFrame]) -> None:
    assert sorted(seen) == [frame.number for frame in frames]
    for frame in frames:
        for index, position in enumerate(frame.positions.astype(np.float32).tolist()):
            expected = None if np.isnan(position).any() else position
            assert seen[frame.number][str(index + 1)] == expected


@pytest.mark.parametrize(("name", "bitstream"), UNICAST, ids=str)
def test_unicast_clients_receive_every_marker_of_every_frame(name: str, bitstream: Bitstream) -> None:
    frames = take(FRAMES, rate_hz=120.0)
    with serve(frames, bitstream=bitstream) as server:
        _assert_all_seen(_seen_by(name, server), frames)


def test_a_multicast_client_receives_every_marker_of_every_frame() -> None:
    frames, port = take(FRAMES, rate_hz=120.0), free_group_port()
    with serve(frames, bitstream=Bitstream(3, 1), multicast=GROUP, data_port=port) as server:
        _assert_all_seen(_seen_by("natnet_multicast", server, port), frames)


@dataclass(frozen=True)
class BodyReel:
    """Rigid bodies; their depth in millimetres is the frame's number."""

    names: tuple[str, ...]
    rate_hz: float = 120.0

    @property
    def times_s(self) -> NDArray[np.float64]:
        """When each frame is due [s]."""
        return np.arange(FRAMES) / self.rate_hz

    @property
    def definitions(self) -> ModelDef:
        """Their names and markers."""
        markers = DescribedMarkers(np.ones((3, 3), np.float32), np.zeros(3, np.int32), ("a", "b", "c"))
        rotation = np.array([0, 0, 0, 1], np.float32)
        return ModelDef(
            tuple(
                RigidBodyDescription(name, number, -1, np.zeros(3, np.float32), rotation, markers)
                for number, name in enumerate(self.names, 3)
            )
        )

    def frame(self, index: int) -> FrameOfData:
        """All of them at one place."""
        table = np.zeros(len(self.names), BODY)
        table["id"] = 3 + np.arange(len(self.names))
        table["position"] = [0.25, 0.5, index / 1000]
        table["quat_xyzw"] = [0.5, -0.5, 0.5, 0.5]
        table["params"] = 1
        return FrameOfData(index, bodies=RigidBodies(table), timestamp_s=index / self.rate_hz)


@pytest.mark.parametrize(
    ("bitstream", "names"),
    [
        (Bitstream(3, 1), ("Band", "Chair")),
        (Bitstream(4, 1), ("Band", "Chair")),
        (Bitstream(4, 2), ("Band",)),  # it does not know the rotation that 4.2 describes, and crashes behind the first
    ],
    ids=str,
)
def test_a_client_of_rigid_bodies_receives_them_by_multicast(bitstream: Bitstream, names: tuple[str, ...]) -> None:
    port = free_group_port()
    settings = ServerSettings(command_port=0, bitstream=bitstream, multicast=GROUP, data_port=port)
    with NatNetServer(BodyReel(names), settings) as server:
        seen = _seen_by("motioncapture", server, port)
    assert len(seen) > FRAMES / 2  # it reads only the newest frame when it is late
    for number, bodies in seen.items():
        assert set(bodies) == set(names)
        assert bodies["Band"] == pytest.approx([0.25, 0.5, number / 1000])
