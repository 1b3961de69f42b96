"""UDP sockets: where they are bound, what they join, how large their buffers are.

Nothing binds to all interfaces unless the caller names the address 0.0.0.0 himself. Where the kernel stamps arrivals
(Linux, SO_TIMESTAMPNS in socket(7)), its time is used, so that a busy receiver thread does not make frames look late.
"""

from __future__ import annotations

import contextlib
import errno
import socket
import struct
import time
from dataclasses import dataclass
from ipaddress import IPv4Address
from typing import TYPE_CHECKING

from retarget.errors import ConnectionFailedError
from retarget.udp.sockets.addresses import (
    LINUX,
    LOOPBACK,
    Address,
    bind,
    broadcast_address,
    is_loopback,
    reason,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

MAX_DATAGRAM = 65_535
RECEIVE_BUFFER = 4 << 20
"""Asked of the kernel [bytes]: 4 s of a stream of 240 Hz with full datagrams; it may grant less."""

_SO_TIMESTAMPNS, _SO_RXQ_OVFL, _IP_MULTICAST_ALL = 35, 40, 49  # linux: asm-generic/socket.h, linux/in.h
_ANCILLARY_BYTES = 128
_TIMESPEC = struct.Struct("@qq")
_COUNT = struct.Struct("@I")
_OLDEST_STAMP_S = 10.0
_GONE = {errno.ECONNREFUSED, errno.ECONNRESET, errno.EHOSTUNREACH, errno.ENETUNREACH, errno.ENETDOWN}
_FULL = {errno.EAGAIN, errno.ENOBUFS, errno.EPERM}


@dataclass(frozen=True, slots=True)
class Received:
    """One datagram and what the kernel says of it."""

    payload: bytes
    peer: Address
    received_s: float
    """Local monotonic time of arrival [s]."""


class UdpSocket:
    """A bound UDP socket that never blocks. Close it, or use it as a context manager."""

    def __init__(self, bound: socket.socket) -> None:
        self._socket = bound
        self._buffer = bytearray(MAX_DATAGRAM)
        self._overflowed = 0
        bound.setblocking(False)

    @property
    def address(self) -> Address:
        """Where this socket is bound."""
        host, port = self._socket.getsockname()
        return host, port

    @property
    def overflowed(self) -> int:
        """Datagrams that the kernel threw away because its buffer was full (Linux; 0 elsewhere)."""
        return self._overflowed

    def fileno(self) -> int:
        """Descriptor for `wait_readable`; -1 once closed."""
        return self._socket.fileno()

    def receive(self) -> Received | None:
        """Take the next datagram, or None when there is none now. Raises `OSError` only once closed."""
        try:
            size, ancillary, _, peer = self._socket.recvmsg_into([self._buffer], _ANCILLARY_BYTES)
        except (BlockingIOError, InterruptedError, ConnectionError):
            return None
        now_s = time.monotonic()
        with memoryview(self._buffer) as view:
            payload = bytes(view[:size])
        return Received(payload, (peer[0], peer[1]), now_s - self._age_s(ancillary))

    def send(self, payload: bytes, peer: Address) -> bool:
        """Send one datagram; False when it could not leave now (buffer full, peer gone, network down)."""
        try:
            self._socket.sendto(payload, peer)
        except OSError as error:
            if error.errno in _GONE | _FULL:
                return False
            raise ConnectionFailedError(f"Cannot send to {peer[0]}:{peer[1]}: {reason(error)}.") from error
        return True

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    def __enter__(self) -> UdpSocket:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _age_s(self, ancillary: Sequence[tuple[int, int, bytes]]) -> float:
        """How long ago the kernel took the datagram in [s]; counts what it lost on the way."""
        age_s = 0.0
        for level, kind, data in ancillary:
            if level != socket.SOL_SOCKET:
                continue
            if kind == _SO_TIMESTAMPNS and len(data) >= _TIMESPEC.size:
                seconds, nanoseconds = _TIMESPEC.unpack_from(data)
                age_s = time.time() - (seconds + 1e-9 * nanoseconds)
            elif kind == _SO_RXQ_OVFL and len(data) >= _COUNT.size:
                self._overflowed = _COUNT.unpack_from(data)[0]
        return age_s if 0.0 <= age_s < _OLDEST_STAMP_S else 0.0  # the wall clock may have been set meanwhile


def open_udp(local: str = LOOPBACK, port: int = 0) -> UdpSocket:
    """Bind to one local address, on a port of the kernel's choice by default.

    Raises `ConnectionFailedError` when the port is in use, needs more rights, or the address is not this machine's.
    """
    bound = udp_socket()
    bind(bound, (local, port))
    return UdpSocket(bound)


def open_broadcast(local: str = LOOPBACK) -> UdpSocket:
    """As `open_udp`, and allowed to send to `broadcast_address`."""
    bound = udp_socket()
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
    bind(bound, (local, 0))
    return UdpSocket(bound)


def open_broadcast_receiver(local: str, port: int) -> UdpSocket:
    """Receive what is broadcast to `port`; several programs of one machine may do so at once."""
    bound = udp_socket()
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    bind(bound, (broadcast_address(local), port))
    return UdpSocket(bound)


def open_multicast_receiver(group: str, port: int, interface: str) -> UdpSocket:
    """Join `group` on the network that has the local address `interface`; several programs may join at once.

    Bound to the group itself, so that only what is sent to it arrives. Raises `ConnectionFailedError` when `group` is
    no multicast address or the interface is not there.
    """
    _require_group(group)
    bound = udp_socket()
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    if LINUX:
        bound.setsockopt(
            socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0
        )  # else groups joined by other programs arrive here too
    bind(bound, (group, port))
    try:
        bound.setsockopt(
            socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + socket.inet_aton(interface)
        )
    except OSError as error:
        bound.close()
        raise ConnectionFailedError(
            f"Cannot join the multicast group {group} on the interface {interface}: {reason(error)}. "
            "Give the address that this machine has on the capture network."
        ) from error
    return UdpSocket(bound)


def open_multicast_sender(interface: str, hops: int = 1) -> UdpSocket:
    """Send to groups through `interface`, at most `hops` routers far; on loopback they never leave the machine."""
    bound = udp_socket()
    bound.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
    bound.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
    bound.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0 if is_loopback(interface) else hops)
    bind(bound, (interface, 0))
    return UdpSocket(bound)


def udp_socket() -> socket.socket:
    """An unbound socket with a large buffer, whose arrivals the kernel stamps where it can."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM, socket.IPPROTO_UDP)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    if LINUX:
        for option in (_SO_TIMESTAMPNS, _SO_RXQ_OVFL):
            with contextlib.suppress(OSError):
                opened.setsockopt(socket.SOL_SOCKET, option, 1)
    return opened


def _require_group(group: str) -> None:
    try:
        multicast = IPv4Address(group).is_multicast
    except ValueError:
        multicast = False
    if not multicast:
        raise ConnectionFailedError(
            f"{group} is not a multicast group: those lie between 224.0.0.0 and 239.255.255.255."
        )
