"""Clients nobody here wrote, each in a process of its own: they print, block, and cannot be stopped.

``python -m tests.udp.natnet.peer_clients NAME COMMAND_PORT DATA_PORT LAST_FRAME`` connects to a server on loopback and
writes one line of JSON: frame number -> name or member id -> position [m], None where the marker is occluded.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import socket
import sys
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    Seen = dict[int, dict[str, list[float] | None]]

HOST = "127.0.0.1"
GROUP = "239.255.42.99"
PATIENCE_S = 15.0
_OCCLUDED = 1
_MEMBER = 0xFFFF


def natnet(command_port: int, data_port: int, seen: Seen, last: int, *, multicast: bool = False) -> None:
    """PyPI `natnet` 0.3.0."""
    from natnet import NatNetClient

    def note(frame: Any) -> None:
        seen[frame.prefix.frame_number] = {
            str(marker.id_num & _MEMBER): None if marker.occluded else list(marker.pos)
            for marker in frame.labeled_markers
        }

    client = NatNetClient(HOST, HOST, GROUP, command_port, data_port, use_multicast=multicast)
    client.on_data_frame_received_event.handlers.append(note)
    with client:
        client.request_modeldef()
        client.run_async()
        _wait(seen, last)


def natnet_multicast(command_port: int, data_port: int, seen: Seen, last: int) -> None:
    """The same, listening to the group."""
    natnet(command_port, data_port, seen, last, multicast=True)


def natnetsdk(command_port: int, _: int, seen: Seen, last: int) -> None:
    """PyPI `natnetsdk` 4.1.1, the vendor's Python sample; what it prints, it prints elsewhere."""
    from natnetsdk.NatNetClient import NatNetClient

    class Client(NatNetClient):  # type: ignore[misc]
        def _NatNetClient__unpack_mocap_data(self, *octets: Any) -> Any:
            answer = super()._NatNetClient__unpack_mocap_data(*octets)
            markers = answer[1].labeled_marker_data.labeled_marker_list
            seen[answer[1].prefix_data.frame_number] = {
                str(m.id_num & _MEMBER): None if m.param & _OCCLUDED else list(m.pos) for m in markers
            }
            return answer

    client = Client()
    client.command_port = command_port
    client.set_use_multicast(False)
    client.set_print_level(0)
    client.run()
    client.send_request(client.command_socket, client.NAT_REQUEST_MODELDEF, "", (HOST, command_port))
    _wait(seen, last)


def optirx(command_port: int, _: int, seen: Seen, last: int) -> None:
    """PyPI `optirx` 1.9, which has no handshake of its own: its data socket is made to connect."""
    import optirx

    data = optirx.mkdatasock(HOST, GROUP, 0)
    data.settimeout(PATIENCE_S)
    for octets in (b"\x00\x00\x00\x00", b"\x04\x00\x00\x00"):
        data.sendto(octets, (HOST, command_port))
    while last not in seen:
        octets = data.recv(optirx.MAX_PACKETSIZE)
        if octets[0] in {optirx.NAT_PINGRESPONSE, optirx.NAT_FRAMEOFDATA}:
            frame = optirx.unpack(octets, (2, 9, 0, 0))
            if isinstance(frame, optirx.FrameOfData):
                seen[frame.frameno] = {
                    str(m.id & _MEMBER): None if m.occluded else list(m.position) for m in frame.labeled_markers
                }


def motioncapture(command_port: int, _: int, seen: Seen, last: int) -> None:
    """PyPI `motioncapture` 1.1: rigid bodies by name, without frame numbers; only the newest frame when it is late."""
    import motioncapture

    client = motioncapture.connect("optitrack", _motioncapture_settings(command_port))
    while last not in seen:
        client.waitForNextFrame()
        bodies = client.rigidBodies
        number = round(1000 * float(next(iter(bodies.values())).position[2]))
        seen[number] = {name: [float(x) for x in body.position] for name, body in bodies.items()}


def _motioncapture_settings(command_port: int) -> dict[str, str]:
    return {"hostname": HOST, "interface_ip": HOST, "port_command": str(command_port)}


CLIENTS: dict[str, Callable[[int, int, Seen, int], None]] = {
    "natnet": natnet,
    "natnet_multicast": natnet_multicast,
    "natnetsdk": natnetsdk,
    "optirx": optirx,
    "motioncapture": motioncapture,
}


def _wait(seen: Seen, last: int) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while last not in seen and time.monotonic() < deadline_s:
        time.sleep(0.01)


def main() -> None:
    """Run one client, write what it saw, and leave without waiting for its threads."""
    name, command_port, data_port, last = sys.argv[1], *map(int, sys.argv[2:])
    socket.setdefaulttimeout(PATIENCE_S)
    seen: Seen = {}
    with contextlib.redirect_stdout(io.StringIO()):
        CLIENTS[name](command_port, data_port, seen, last)
    sys.stdout.write(json.dumps(seen) + "\n")
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
