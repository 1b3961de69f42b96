"""When a server is not heard where it should be: what the network says, and who is heard elsewhere."""

from __future__ import annotations

import time
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING

from retarget.errors import ConnectionFailedError
from retarget.udp.natnet.codec import encode
from retarget.udp.natnet.messages import Discovery, MessageId, Sender
from retarget.udp.natnet.url import DEFAULT_BITSTREAM
from retarget.udp.sockets import Probe, local_addresses, open_multicast_receiver, open_udp, wait_readable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from retarget.udp.sockets import Address, Received, UdpSocket

_QUESTION = encode(Discovery(Sender.named("retarget", (0, 1, 0, 0), (*DEFAULT_BITSTREAM, 0, 0))))
_FRAME = int(MessageId.FRAMEOFDATA).to_bytes(2, "little")
_LISTEN_S = 0.5
_MOST_HEARD = 32


def probe(server: Address, local: str) -> Probe:
    """Ask the server for what the network says against it; the question makes no client."""
    return Probe(_QUESTION, server, local)


def who_answers(server: Address, local: str) -> list[Address]:
    """Who answers a question to `server` instead of it."""
    heard: list[Address] = []

    def note(_: UdpSocket, received: Received) -> None:
        if received.peer != server and received.peer not in heard:
            heard.append(received.peer)

    with open_udp(local) as asking:
        asking.send(_QUESTION, server)
        _listen([asking], note)
    return heard


def who_multicasts(group: Address) -> list[tuple[str, Address]]:
    """Who sends frames to a group: the address of ours where they are heard, and the sender's."""
    heard: list[tuple[str, Address]] = []
    with ExitStack() as opened:
        listening: dict[UdpSocket, str] = {}
        for interface in local_addresses():
            with suppress(ConnectionFailedError):  # a network card without multicast
                listening[opened.enter_context(open_multicast_receiver(*group, interface))] = interface

        def note(source: UdpSocket, received: Received) -> None:
            found = (listening[source], received.peer)
            if received.payload.startswith(_FRAME) and found not in heard:
                heard.append(found)

        _listen([*listening], note)
    return heard


def _listen(sources: Sequence[UdpSocket], note: Callable[[UdpSocket, Received], None]) -> None:
    """Hand on all that comes for a while, from each source only so much at a time."""
    deadline_s = time.monotonic() + _LISTEN_S
    while (left_s := deadline_s - time.monotonic()) > 0:
        wait_readable(sources, left_s)
        for source in sources:
            for _ in range(_MOST_HEARD):
                received = source.receive()
                if received is None:
                    break
                note(source, received)
