"""OpenVHead's connection over TCP, both ends: its Unity server listens at port 1755, its camera client connects.

`OpenVHeadClient` takes the place of its client, so that its server works with our camera; `OpenVHeadServer` takes the
place of its server. Every message leaves as a segment of its own, since the Unity server takes what it receives at once
for one message.
"""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING, Literal, NamedTuple, Self

from retarget.errors import ConnectionFailedError, ProtocolError
from retarget.udp.address import parse_address
from retarget.udp.openvhead_message import PORT, OpenVHeadMessage, OpenVHeadStream, encode
from retarget.udp.sockets import connect_tcp, listen_tcp, wait_readable

if TYPE_CHECKING:
    from collections.abc import Iterator

    from retarget.udp.sockets import Address, TcpListener, TcpStream

log = logging.getLogger("retarget.openvhead")

Framing = Literal["none", "newline"]
"""What stands behind each message: nothing, as OpenVHead has it, or a newline."""

PATIENCE_S = 0.5
"""For a peer to take a connection, or to read, after which it is taken for gone."""
SILENCE_S = 0.005
"""Without more bytes, after which what came is taken for whole."""
_LONGEST_WAIT_S = 0.2


class OpenVHeadClient:
    """Sends messages to ``tcp://HOST:PORT``; a context manager. Where nobody listens it drops them and tries again."""

    def __init__(self, url: str = f"tcp://127.0.0.1:{PORT}", framing: Framing = "none", retry_s: float = 1.0) -> None:
        """`retry_s` [s] between attempts to connect; InputError for an address that cannot be read."""
        self._peer = parse_address(url, "tcp", PORT)
        self._end = b"\n" if framing == "newline" else b""
        self._retry_s = retry_s
        self._stream: TcpStream | None = None
        self._next_try_s = 0.0
        self._has_complained = False
        self.sent = 0
        self.dropped = 0
        """Messages for which there was no connection."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __call__(self, message: OpenVHeadMessage) -> bool:
        """Send one message; False if it was dropped."""
        stream = self._connected()
        if stream is not None and stream.send(encode(message) + self._end):
            self.sent += 1
            return True
        if stream is not None:
            self._hang_up()
        self.dropped += 1
        return False

    def close(self) -> None:
        """Hang up."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None

    def _connected(self) -> TcpStream | None:
        if self._stream is not None and self._stream.receive() == b"":
            self._hang_up()
        if self._stream is None and time.monotonic() >= self._next_try_s:
            self._connect()
        return self._stream

    def _connect(self) -> None:
        try:
            self._stream = connect_tcp(self._peer, PATIENCE_S)
        except ConnectionFailedError as error:
            if not self._has_complained:
                log.warning("%s Trying again every %g s.", error, self._retry_s)
            self._has_complained = True
            self._next_try_s = time.monotonic() + self._retry_s
        else:
            log.info("Connected to %s:%d.", *self._peer)
            self._has_complained = False

    def _hang_up(self) -> None:
        self.close()
        self._next_try_s = time.monotonic() + self._retry_s
        self._has_complained = True
        log.warning("%s:%d has gone; trying again every %g s.", *self._peer, self._retry_s)


class Arrived(NamedTuple):
    """A message and when it was complete."""

    received_s: float
    """Local monotonic [s]."""
    message: OpenVHeadMessage


class OpenVHeadServer:
    """Takes one client after the other at ``tcp://HOST:PORT``; an iterator of `Arrived` and a context manager.

    A client that breaks the protocol loses the message, as OpenVHead's server has it, and may go on. Clients that wait
    are taken once the one before has gone.
    """

    def __init__(self, url: str = f"tcp://127.0.0.1:{PORT}") -> None:
        """InputError for an address that cannot be read."""
        self._local = parse_address(url, "tcp", PORT)
        self._listener: TcpListener | None = None
        self._client: TcpStream | None = None
        self._messages = OpenVHeadStream()
        self._stopped = threading.Event()
        self.received = 0
        self.malformed = 0
        """Times that what came was no message."""

    @property
    def address(self) -> Address:
        """Where it listens, once open."""
        return self._local if self._listener is None else self._listener.address

    def stop(self) -> None:
        """End the iteration soon; may be called from another thread or from a signal's function."""
        self._stopped.set()

    def __enter__(self) -> Self:
        """`ConnectionFailedError` where the port is in use."""
        self._listener = listen_tcp(*self._local)
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self._drop_client()
        if self._listener is not None:
            self._listener.close()

    def __iter__(self) -> Iterator[Arrived]:
        if self._listener is None:
            raise ConnectionFailedError("OpenVHead's server is not open; use it as a context manager.")
        while not self._stopped.is_set():
            if self._client is None:
                self._welcome(self._listener)
                continue
            for message in self._next(self._client):
                self.received += 1
                yield Arrived(time.monotonic(), message)

    def _welcome(self, listener: TcpListener) -> None:
        if wait_readable([listener.fileno()], _LONGEST_WAIT_S):
            self._client = listener.accept(PATIENCE_S)
            self._messages.reset()
            if self._client is not None:
                log.info("OpenVHead's client connected.")

    def _next(self, client: TcpStream) -> list[OpenVHeadMessage]:
        """What one wait brings; the client is dropped when it has gone."""
        more = wait_readable([client.fileno()], SILENCE_S if self._messages.waits else _LONGEST_WAIT_S)
        try:
            if not more:
                return self._messages.flush()
            received = client.receive()
            if received is None:
                return []
            if received:
                messages = self._messages.feed(received)
                return messages if not self._messages.ended else messages + self._farewell()
            return self._farewell()
        except ProtocolError as error:
            if not self.malformed:
                log.warning("%s It is passed over.", error)
            self.malformed += 1
            return []

    def _farewell(self) -> list[OpenVHeadMessage]:
        self._drop_client()
        log.info("OpenVHead's client has gone; waiting for the next.")
        return self._messages.flush()

    def _drop_client(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None
