"""Finding NatNet servers: a question to everybody on the network, and who answered."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from retarget.errors import ConnectionFailedError, InputError, ProtocolError
from retarget.udp.natnet.codec import decode, encode
from retarget.udp.natnet.messages import Discovery, Sender, ServerInfo
from retarget.udp.natnet.url import COMMAND_PORT, DEFAULT_BITSTREAM
from retarget.udp.sockets import (
    LOOPBACK,
    broadcast_address,
    is_loopback,
    local_address_towards,
    open_broadcast,
    wait_readable,
)

if TYPE_CHECKING:
    from retarget.udp.sockets import Address, UdpSocket

_MOST_SERVERS = 64
_SOMEWHERE = "192.0.2.1"  # TEST-NET-1 of RFC 5737: never reached, but routed to where the network is
_WAIT_S = 0.6


@dataclass(frozen=True, slots=True)
class FoundServer:
    """A server that answered."""

    address: Address
    """Its address and command port."""
    local: str
    """The address of ours from which it is reached."""
    info: ServerInfo

    def __str__(self) -> str:
        return f"{self.info.sender.name} at {self.address[0]}:{self.address[1]}"


def discover(local: str, port: int = COMMAND_PORT, wait_s: float = _WAIT_S) -> list[FoundServer]:
    """Ask the network of our address `local` who serves NatNet; wait `wait_s` [s] for all answers."""
    question = encode(Discovery(Sender.named("retarget", (0, 1, 0, 0), (*DEFAULT_BITSTREAM, 0, 0))))
    found: dict[Address, FoundServer] = {}
    with open_broadcast(local) as asking:
        asking.send(question, (broadcast_address(local), port))
        if is_loopback(local):
            asking.send(question, (local, port))
        deadline_s = time.monotonic() + wait_s
        while time.monotonic() < deadline_s and len(found) < _MOST_SERVERS:
            wait_readable([asking], deadline_s - time.monotonic())
            _collect(asking, local, found)
    return list(found.values())


def find_server(port: int = COMMAND_PORT, local: str | None = None) -> FoundServer:
    """Return the one server there is, on the network of `local`, or else on this machine or the default network.

    Raises `ConnectionFailedError` when there is none, `InputError` when there are several to choose from.
    """
    networks = [local] if local is not None else [LOOPBACK, *_default_network()]
    found = [server for network in networks for server in discover(network, port)]
    if not found:
        raise ConnectionFailedError(
            f"No NatNet server answers on {' or '.join(networks)}. Name it, natnet://ADDRESS, or give the address that "
            "this machine has on the capture network, natnet://?local=ADDRESS."
        )
    if len(found) > 1:
        raise InputError(f"Several NatNet servers answer: {', '.join(map(str, found))}. Name one, natnet://ADDRESS.")
    return found[0]


def _default_network() -> list[str]:
    try:
        local = local_address_towards(_SOMEWHERE)
    except ConnectionFailedError:
        return []
    return [] if is_loopback(local) else [local]


def _collect(asking: UdpSocket, local: str, found: dict[Address, FoundServer]) -> None:
    while (received := asking.receive()) is not None:
        try:
            message = decode(received.payload)
        except ProtocolError:
            continue
        if isinstance(message, ServerInfo):
            found[received.peer] = FoundServer(received.peer, local, message)
