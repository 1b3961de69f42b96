"""The only sockets of this package, UDP and TCP: where they are bound, what they join, how large their buffers are.

Nothing binds to all interfaces unless the caller names the address 0.0.0.0 himself. Where the kernel stamps arrivals
(Linux, SO_TIMESTAMPNS in socket(7)), its time is used, so that a busy receiver thread does not make frames look late.
"""

from __future__ import annotations

import contextlib
import errno
import math
import select
import socket
import struct
import sys
import time
from dataclasses import dataclass
from enum import Enum
from ipaddress import IPv4Address, ip_address
from typing import TYPE_CHECKING

from retarget.errors import ConnectionFailedError

if TYPE_CHECKING:
    from collections.abc import Sequence

Address = tuple[str, int]
"""IPv4 address in dotted form, and port."""

LOOPBACK = "127.0.0.1"
MAX_DATAGRAM = 65_535
RECEIVE_BUFFER = 4 << 20
"""Asked of the kernel [bytes]: 4 s of a stream of 240 Hz with full datagrams; it may grant less."""

_LINUX = sys.platform == "linux"
_SO_TIMESTAMPNS, _SO_RXQ_OVFL, _IP_MULTICAST_ALL = 35, 40, 49  # linux: asm-generic/socket.h, linux/in.h
_IP_RECVERR, _SIOCGIFADDR = 11, 0x8915  # linux: linux/in.h, linux/sockios.h
_IFREQ = struct.Struct("16s4x4s16x")
_ANCILLARY_BYTES = 128
_TIMESPEC = struct.Struct("@qq")
_COUNT = struct.Struct("@I")
_OLDEST_STAMP_S = 10.0
_GONE = {errno.ECONNREFUSED, errno.ECONNRESET, errno.EHOSTUNREACH, errno.ENETUNREACH, errno.ENETDOWN}
_FULL = {errno.EAGAIN, errno.ENOBUFS, errno.EPERM}
_TCP_READ = 65_536


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
            raise ConnectionFailedError(f"Cannot send to {peer[0]}:{peer[1]}: {_reason(error)}.") from error
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


class Probe:
    """One datagram to `peer`, and what the network says against it; use it as a context manager.

    Systems other than Linux tell only of a port that nobody has.
    """

    def __init__(self, payload: bytes, peer: Address, local: str) -> None:
        self._socket = _udp_socket()
        _bind(self._socket, (local, 0))
        self._refusal: Refusal | None = None
        if _LINUX:
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


class TcpStream:
    """One TCP connection. Close it, or use it as a context manager."""

    def __init__(self, connected: socket.socket, patience_s: float) -> None:
        """`patience_s` [s] is how long `send` waits for a peer that does not read."""
        self._socket = connected
        connected.settimeout(patience_s)
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # each message leaves at once, on its own

    @property
    def peer(self) -> Address:
        """The other end."""
        host, port = self._socket.getpeername()
        return host, port

    def fileno(self) -> int:
        """Descriptor for `wait_readable`; -1 once closed."""
        return self._socket.fileno()

    def receive(self) -> bytes | None:
        """What has come; None when there is nothing now, empty when the peer has gone."""
        if not wait_readable([self._socket.fileno()], 0.0):
            return None
        try:
            return self._socket.recv(_TCP_READ)
        except TimeoutError:
            return None
        except OSError:
            return b""

    def send(self, payload: bytes) -> bool:
        """Send all of it; False when the peer has gone or does not read."""
        try:
            self._socket.sendall(payload)
        except OSError:  # a timeout too
            return False
        return True

    def close(self) -> None:
        """Hang up."""
        self._socket.close()

    def __enter__(self) -> TcpStream:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class TcpListener:
    """A TCP port that others connect to. Close it, or use it as a context manager."""

    def __init__(self, listening: socket.socket) -> None:
        self._socket = listening
        listening.setblocking(False)

    @property
    def address(self) -> Address:
        """Where this socket is bound."""
        host, port = self._socket.getsockname()
        return host, port

    def fileno(self) -> int:
        """Descriptor for `wait_readable`; -1 once closed."""
        return self._socket.fileno()

    def accept(self, patience_s: float) -> TcpStream | None:
        """The next peer that wants to connect, None when there is none now."""
        try:
            connected, _ = self._socket.accept()
        except OSError:
            return None
        return TcpStream(connected, patience_s)

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    def __enter__(self) -> TcpListener:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def connect_tcp(address: Address, patience_s: float) -> TcpStream:
    """Connect within `patience_s` [s]; raises `ConnectionFailedError` when nobody listens there."""
    host, port = address
    opened = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    opened.settimeout(patience_s)
    try:
        opened.connect(address)
        if opened.getsockname() == opened.getpeername():  # the kernel chose the very port that nobody listens on
            raise ConnectionRefusedError(errno.ECONNREFUSED, "Connection refused")
    except OSError as error:
        opened.close()
        raise ConnectionFailedError(
            f"Nobody takes a TCP connection at {host}:{port} ({_reason(error)}); start the program that listens there."
        ) from error
    return TcpStream(opened, patience_s)


def listen_tcp(local: str, port: int, backlog: int = 10) -> TcpListener:
    """Listen at one local address; raises `ConnectionFailedError` as `open_udp` does."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    if sys.platform != "win32":  # there it would let two programs listen at once
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    _bind(opened, (local, port))
    try:
        opened.listen(backlog)
    except OSError as error:
        opened.close()
        raise ConnectionFailedError(f"Cannot listen at {local}:{port}: {_advice(error, local, port)}.") from error
    return TcpListener(opened)


def open_udp(local: str = LOOPBACK, port: int = 0) -> UdpSocket:
    """Bind to one local address, on a port of the kernel's choice by default.

    Raises `ConnectionFailedError` when the port is in use, needs more rights, or the address is not this machine's.
    """
    bound = _udp_socket()
    _bind(bound, (local, port))
    return UdpSocket(bound)


def open_broadcast(local: str = LOOPBACK) -> UdpSocket:
    """As `open_udp`, and allowed to send to `broadcast_address`."""
    bound = _udp_socket()
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
    _bind(bound, (local, 0))
    return UdpSocket(bound)


def open_broadcast_receiver(local: str, port: int) -> UdpSocket:
    """Receive what is broadcast to `port`; several programs of one machine may do so at once."""
    bound = _udp_socket()
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    _bind(bound, (broadcast_address(local), port))
    return UdpSocket(bound)


def open_multicast_receiver(group: str, port: int, interface: str) -> UdpSocket:
    """Join `group` on the network that has the local address `interface`; several programs may join at once.

    Bound to the group itself, so that only what is sent to it arrives. Raises `ConnectionFailedError` when `group` is
    no multicast address or the interface is not there.
    """
    _require_group(group)
    bound = _udp_socket()
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    if _LINUX:
        bound.setsockopt(
            socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0
        )  # else groups joined by other programs arrive here too
    _bind(bound, (group, port))
    try:
        bound.setsockopt(
            socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + socket.inet_aton(interface)
        )
    except OSError as error:
        bound.close()
        raise ConnectionFailedError(
            f"Cannot join the multicast group {group} on the interface {interface}: {_reason(error)}. "
            "Give the address that this machine has on the capture network."
        ) from error
    return UdpSocket(bound)


def open_multicast_sender(interface: str, hops: int = 1) -> UdpSocket:
    """Send to groups through `interface`, at most `hops` routers far; on loopback they never leave the machine."""
    bound = _udp_socket()
    bound.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
    bound.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
    bound.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0 if is_loopback(interface) else hops)
    _bind(bound, (interface, 0))
    return UdpSocket(bound)


def resolve(host: str) -> str:
    """IPv4 address of a host name; raise `ConnectionFailedError` when there is none."""
    try:
        found = socket.getaddrinfo(host, None, socket.AF_INET, socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        raise ConnectionFailedError(
            f"The host {host!r} is not known: give its IPv4 address, or check the spelling and the name service."
        ) from error
    return str(found[0][4][0])


def local_address_towards(host: str) -> str:
    """The address of ours from which `host` (an IPv4 address) is reached; sends nothing."""
    with _udp_socket() as probe:
        try:
            probe.connect((host, 9))
        except OSError as error:
            raise ConnectionFailedError(
                f"No network leads to {host}: {_reason(error)}. Check the cable and the address."
            ) from error
        return str(probe.getsockname()[0])


def local_addresses() -> list[str]:
    """IPv4 addresses of this machine, one for each network card (Linux; elsewhere none)."""
    if not _LINUX:
        return []
    import fcntl

    found = []
    with _udp_socket() as asking:
        for _, name in socket.if_nameindex():
            with contextlib.suppress(OSError):  # a card without an address
                answer = fcntl.ioctl(asking, _SIOCGIFADDR, _IFREQ.pack(name.encode(), bytes(4)))
                found.append(socket.inet_ntoa(_IFREQ.unpack(answer)[1]))
    return found


def broadcast_address(local: str) -> str:
    """Where everybody on the network of `local` is reached."""
    return "127.255.255.255" if is_loopback(local) else "255.255.255.255"


def is_loopback(host: str) -> bool:
    """Whether an IPv4 address never leaves this machine."""
    return ip_address(host).is_loopback


def wait_readable(sockets: Sequence[UdpSocket | int], timeout_s: float) -> list[int]:
    """Descriptors of those that hold something, at the latest after `timeout_s` [s] (rounded up to milliseconds)."""
    waiting = select.poll()
    for each in sockets:
        descriptor = each if isinstance(each, int) else each.fileno()
        if descriptor >= 0:
            waiting.register(descriptor, select.POLLIN)
    return [descriptor for descriptor, _ in waiting.poll(math.ceil(1e3 * max(0.0, timeout_s)))]


def _udp_socket() -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM, socket.IPPROTO_UDP)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    if _LINUX:
        for option in (_SO_TIMESTAMPNS, _SO_RXQ_OVFL):
            with contextlib.suppress(OSError):
                opened.setsockopt(socket.SOL_SOCKET, option, 1)
    return opened


def _bind(unbound: socket.socket, address: Address) -> None:
    host, port = address
    try:
        unbound.bind(address)
    except OSError as error:
        unbound.close()
        raise ConnectionFailedError(f"Cannot use {host}:{port}: {_advice(error, host, port)}.") from error


def _advice(error: OSError, host: str, port: int) -> str:
    if error.errno == errno.EADDRINUSE:
        return f"port {port} is in use; stop the program that uses it, or choose another port"
    if error.errno in {errno.EACCES, errno.EPERM}:
        return f"port {port} needs more rights; choose one above 1023"
    if error.errno == errno.EADDRNOTAVAIL or isinstance(error, socket.gaierror):
        return f"{host} is not an address of this machine; give one of its own, such as {LOOPBACK}"
    return _reason(error)


def _reason(error: OSError) -> str:
    return (error.strerror or str(error)).rstrip(".").lower()


def _require_group(group: str) -> None:
    try:
        multicast = IPv4Address(group).is_multicast
    except ValueError:
        multicast = False
    if not multicast:
        raise ConnectionFailedError(
            f"{group} is not a multicast group: those lie between 224.0.0.0 and 239.255.255.255."
        )
