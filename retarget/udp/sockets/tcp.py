"""TCP connections: a stream, a port that others connect to. Nothing here waits without an end."""

from __future__ import annotations

import errno
import socket
import sys

from retarget.errors import ConnectionFailedError
from retarget.udp.sockets.addresses import Address, advice, bind, reason
from retarget.udp.sockets.waiting import wait_readable

_TCP_READ = 65_536


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
            f"Nobody takes a TCP connection at {host}:{port} ({reason(error)}); start the program that listens there."
        ) from error
    return TcpStream(opened, patience_s)


def listen_tcp(local: str, port: int, backlog: int = 10) -> TcpListener:
    """Listen at one local address; raises `ConnectionFailedError` as `open_udp` does."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    if sys.platform != "win32":  # there it would let two programs listen at once
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    bind(opened, (local, port))
    try:
        opened.listen(backlog)
    except OSError as error:
        opened.close()
        raise ConnectionFailedError(f"Cannot listen at {local}:{port}: {advice(error, local, port)}.") from error
    return TcpListener(opened)
