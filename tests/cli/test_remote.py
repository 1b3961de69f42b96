"""`retarget remote`, against our own server and a port where nobody is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from click.testing import CliRunner, Result

from retarget.cli.main import main
from retarget.markers.c3d import read_c3d
from retarget.udp.natnet.reel import MarkerReel
from retarget.udp.natnet.server import NatNetServer, ServerSettings
from retarget.udp.natnet.source import NatNetSource
from retarget.udp.sockets import open_udp

if TYPE_CHECKING:
    from collections.abc import Iterator

TAKE = Path(__file__).parents[2] / "takes" / "demo.c3d"


@pytest.fixture
def server() -> Iterator[NatNetServer]:
    with NatNetServer(MarkerReel(list(read_c3d(TAKE))), ServerSettings(command_port=0)) as running:
        yield running


def remote(port: int, *order: str) -> Result:
    return CliRunner().invoke(main, ["remote", f"natnet://127.0.0.1:{port}", *order])


def test_a_server_pauses_seeks_and_plays_on_from_there(server: NatNetServer) -> None:
    port = server.address[1]
    with NatNetSource(f"natnet://127.0.0.1:{port}") as source:
        next(source)
        assert remote(port, "pause").output == "pause: done\n"
        assert remote(port, "seek", "900").exit_code == 0
        assert remote(port, "play").exit_code == 0
        numbers = [next(source).number for _ in range(150)]
    assert 900 in numbers
    assert numbers[-1] > 900


def test_a_replay_does_not_record(server: NatNetServer) -> None:
    result = remote(server.address[1], "start-recording")
    assert result.exit_code == 1
    assert "StartRecording" in result.stderr


@pytest.mark.parametrize("order", [("seek",), ("seek", "soon"), ("play", "1"), ("dance",), ("range", "3")])
def test_a_wrong_order_is_wrong_usage(order: tuple[str, ...]) -> None:
    assert remote(1, *order).exit_code == 2


def test_nobody_there_is_told() -> None:
    with open_udp("127.0.0.1", 0) as silent:
        result = remote(silent.address[1], "play")
    assert result.exit_code == 1
    assert "127.0.0.1" in result.stderr
