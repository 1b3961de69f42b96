"""What the network answers for a peer that cannot be had."""

from __future__ import annotations

import errno
import math
import select
import socket
from enum import Enum

from retarget.udp.sockets.addresses import LINUX, Address, bind
from retarget.udp.sockets.udp import udp_socket

_IP_RECVERR = 11  # linux: linux/in.h


class Refusal(Enum):
    """What the network answers for a peer that cannot be had (ICMP destination unreachable, RFC 792)."""

    PORT = "port"
    """The machine is there and no program has the port."""
    HOST = "host"
    """No machine has the address, or a firewall on the way says that it must not be reached."""


_REFUSALS = {
    errno.ECONNREFUSED: Refusal.PORT,
    errno.EHOSTUNREACH: Refusal.HOST,
    errno.ENETUNREACH: Refusal.HOST,
    errno.EACCES: Refusal.HOST,
}


class Probe:
    """One datagram to `peer`, and what the network says against it; use it as a context manager.

    Systems other than Linux tell only of a port that nobody has.
    """

    def __init__(self, payload: bytes, peer: Address, local: str) -> None:
        self._socket = udp_socket()
        bind(self._socket, (local, 0))
        self._refusal: Refusal | None = None
        if LINUX:
            self._socket.setsockopt(socket.IPPROTO_IP, _IP_RECVERR, 1)
        try:
            self._socket.connect(peer)  # the kernel hands ICMP on only to a socket that has one peer
            self._socket.send(payload)
        except OSError as error:
            self._refusal = _REFUSALS.get(error.errno or 0)

    def refusal(self, wait_s: float) -> Refusal | None:
        """What was said up to now; waits for a word or an answer at most `wait_s` [s].

        That a machine does not answer to its address the kernel says after about three seconds.
        """
        if self._refusal is None:
            waiting = select.poll()
            waiting.register(self._socket, select.POLLIN)
            waiting.poll(math.ceil(1e3 * wait_s))
            self._refusal = _REFUSALS.get(self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR))
        return self._refusal

    def __enter__(self) -> Probe:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
