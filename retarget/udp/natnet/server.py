"""A live NatNet server over frames that are there already: what `retarget replay` runs.

    with NatNetServer(MarkerReel(frames), ServerSettings(command_port=1510)) as server:
        server.wait()

Unicast, it sends each client its own bitstream from the command port; multicast, it sends one bitstream to the group.
It binds to loopback unless told otherwise. Two threads: one answers commands, the other plays.
"""

from __future__ import annotations

import logging
import os
import threading
import time
from contextlib import ExitStack
from dataclasses import dataclass, field
from ipaddress import ip_address
from typing import TYPE_CHECKING

from retarget.errors import ConnectionFailedError
from retarget.udp.natnet.codec import encode
from retarget.udp.natnet.messages import ConnectionInfo, DisconnectByTimeout
from retarget.udp.natnet.pacing import OriginalPace, Pace, SteadyPace
from retarget.udp.natnet.playback import AtEnd, Playback
from retarget.udp.natnet.player import Begin, Outlet, Player
from retarget.udp.natnet.responder import Responder
from retarget.udp.natnet.retry import Retry
from retarget.udp.natnet.url import COMMAND_PORT, DATA_PORT, DEFAULT_BITSTREAM, MULTICAST_GROUP
from retarget.udp.sockets import (
    LOOPBACK,
    open_broadcast_receiver,
    open_multicast_sender,
    open_udp,
    resolve,
    wait_readable,
)

if TYPE_CHECKING:
    from retarget.udp.natnet.reel import Reel
    from retarget.udp.natnet.version import Bitstream
    from retarget.udp.sockets import Address, UdpSocket

CLOCK_HZ = 10_000_000
"""Ticks per second of the server's clock, as Motive 3 has it."""

_EXPIRY_S = 0.5
_BURST = 64
_log = logging.getLogger("retarget.natnet")


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """How and where a reel is served."""

    host: str = LOOPBACK
    """Address of ours to serve on."""
    command_port: int = COMMAND_PORT
    """0 leaves the choice to the kernel."""
    bitstream: Bitstream = DEFAULT_BITSTREAM
    """The server's own and newest; clients that can choose may take an older one."""
    multicast: str | None = None
    """Group to send to instead of to each client."""
    data_port: int = DATA_PORT
    """Port of the group."""
    hops: int = 1
    """Routers that multicast may pass, and one."""
    pace: Pace = field(default_factory=OriginalPace)
    speed: float = 1.0
    at_end: AtEnd = AtEnd.STOP
    begin: Begin = Begin.WITH_FIRST_CLIENT


class NatNetServer:
    """Serves one reel from the moment it is made until it is closed; use it as a context manager.

    Raises `ConnectionFailedError` when the port is in use or the address not this machine's, `InputError` for a speed
    that cannot be played.
    """

    def __init__(self, reel: Reel, settings: ServerSettings | None = None) -> None:
        settings = settings if settings is not None else ServerSettings()
        self._changed = threading.Condition()
        self._playback = Playback(len(reel.times_s), settings.speed, settings.at_end)
        self._responder = Responder(
            reel, self._playback, settings.bitstream, _connection_info(settings), _rate_hz(reel, settings.pace)
        )
        self._sockets = ExitStack()
        with ExitStack() as opened:  # gives the first port back when the second cannot be had
            host = resolve(settings.host)
            self._commands = opened.enter_context(open_udp(host, settings.command_port))
            sender = self._commands
            if settings.multicast is not None:
                sender = opened.enter_context(open_multicast_sender(host, settings.hops))
            self._listening = [self._commands, *_discovery_socket(opened, *self._commands.address)]
            self._sockets = opened.pop_all()
        self._player = Player(
            reel, self._playback, settings.pace, settings.begin, self._responder.clients, self._changed,
            Outlet(sender.send, self._commands.send, CLOCK_HZ, _group(settings)),
        )  # fmt: skip
        self._closing = False
        self._woken, self._waker = os.pipe()
        self._answering = threading.Thread(target=self._answer_all, name="natnet commands", daemon=True)
        self._answering.start()
        self._player.start()

    def __enter__(self) -> NatNetServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def address(self) -> Address:
        """Address and command port."""
        return self._commands.address

    @property
    def clients(self) -> int:
        """How many are connected in unicast."""
        with self._changed:
            return len(self._responder.clients)

    @property
    def frames_sent(self) -> int:
        """Frames played up to now."""
        return self._player.sent

    @property
    def datagrams_unsent(self) -> int:
        """Frames that could not leave to one client or another."""
        return self._player.unsent

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait until the last frame was played and all clients were told; whether that is so."""
        return self._player.wait(timeout_s)

    def close(self) -> None:
        """Take leave of all clients and give the ports back."""
        if self._closing:
            return
        self._player.stop()
        self._closing = True
        os.write(self._waker, b"x")
        self._answering.join()
        self._sockets.close()
        os.close(self._woken)
        os.close(self._waker)

    def _answer_all(self) -> None:
        expiry = Retry(_EXPIRY_S, 1, _EXPIRY_S)
        while not self._closing:
            wait_readable([*self._listening, self._woken], _EXPIRY_S)
            for listening in self._listening:
                self._answer_some(listening)
            if expiry.due(time.monotonic()):
                self._expire()

    def _expire(self) -> None:
        with self._changed:
            gone = self._responder.clients.expire(time.monotonic())
        for client in gone:
            _log.info("%s:%d was silent and is dropped.", *client.address)
            self._commands.send(encode(DisconnectByTimeout()), client.address)

    def _answer_some(self, listening: UdpSocket) -> None:
        for _ in range(_BURST):
            received = listening.receive()
            if received is None:
                return
            with self._changed:
                reply = self._responder.answer(received.payload, received.peer, time.monotonic())
                if reply is not None:
                    self._changed.notify_all()
            if reply is not None:
                self._commands.send(reply, received.peer)


def _connection_info(settings: ServerSettings) -> ConnectionInfo:
    group = settings.multicast
    return ConnectionInfo(CLOCK_HZ, settings.data_port, int(group is not None), group or MULTICAST_GROUP)


def _group(settings: ServerSettings) -> tuple[Address, Bitstream] | None:
    if settings.multicast is None:
        return None
    return (settings.multicast, settings.data_port), settings.bitstream


def _rate_hz(reel: Reel, pace: Pace) -> float:
    return pace.rate_hz if isinstance(pace, SteadyPace) else reel.rate_hz


def _discovery_socket(opened: ExitStack, host: str, port: int) -> list[UdpSocket]:
    """A socket for what is broadcast, which one bound to a single address does not get; none where it is taken."""
    if ip_address(host).is_unspecified:
        return []
    try:
        return [opened.enter_context(open_broadcast_receiver(host, port))]
    except ConnectionFailedError as error:
        _log.info("Clients cannot find this server by discovery: %s", error)
        return []
