"""NatNet servers on loopback that are broken in a chosen way."""

from __future__ import annotations

import threading
import time
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from retarget.errors import ProtocolError
from retarget.udp.natnet.codec import decode, encode
from retarget.udp.natnet.framedata import LabelledMarkers, Ticks
from retarget.udp.natnet.messages import (
    Connect,
    ConnectionInfo,
    Disconnect,
    Discovery,
    EchoRequest,
    EchoResponse,
    Request,
    RequestModelDef,
    Sender,
    ServerInfo,
    UnrecognizedRequest,
)
from retarget.udp.natnet.reel import MarkerReel
from retarget.udp.natnet.version import Bitstream
from retarget.udp.sockets import LOOPBACK, open_multicast_sender, open_udp, wait_readable
from tests.udp.natnet.live import GROUP, take

if TYPE_CHECKING:
    from collections.abc import Callable

    from retarget.udp.natnet.framedata import FrameOfData
    from retarget.udp.natnet.messages import Message
    from retarget.udp.natnet.models import ModelDef
    from retarget.udp.sockets import Address

TICKS_HZ = 1_000_000
RATE_HZ = 100.0
WRITTEN_IN = Bitstream(4, 1)


@dataclass
class Script:
    """What a server does; by default nothing is wrong with it."""

    mute: tuple[type[Message], ...] = ()
    """Messages that it does not answer."""
    version: tuple[int, int] = (4, 1)
    """Bitstream that it announces."""
    group: Address | None = None
    """Announced as multicast."""
    sends_to: Address | None = None
    """Group that frames go to; None: to each client."""
    sends_from: str = LOOPBACK
    """Address from which the group is sent to."""
    answers_from: str | None = None
    """Another address from which it answers."""
    frame: Callable[[FrameOfData], FrameOfData | None] = lambda data: data
    """Changes a frame, or keeps it back."""
    tail: bytes = b""
    """Octets behind every frame."""
    definitions: Callable[[ModelDef], ModelDef] = lambda definitions: definitions
    ends_after: int | None = None
    """Frames until it takes its leave."""


class BrokenServer:
    """Runs a script on a thread of its own until closed; use it as a context manager."""

    def __init__(self, script: Script) -> None:
        self._script = script
        self._reel = MarkerReel(take(50))
        self._client: Address | None = None
        self._opened = ExitStack()
        self._commands = self._opened.enter_context(open_udp())
        self._sender = self._commands
        if script.sends_to is not None:
            self._sender = self._opened.enter_context(open_multicast_sender(script.sends_from))
        self._replies = self._commands
        if script.answers_from is not None:
            self._replies = self._opened.enter_context(open_udp(script.answers_from))
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.set()
        self._thread.join()
        self._opened.close()

    @property
    def url(self) -> str:
        """Where it is."""
        return f"natnet://{self._commands.address[0]}:{self._commands.address[1]}"

    def _run(self) -> None:
        number, next_s = 0, time.monotonic()
        while not self._closing.is_set():
            wait_readable([self._commands], max(0.0, next_s - time.monotonic()))
            while (received := self._commands.receive()) is not None:
                self._take(received.payload, received.peer)
            if time.monotonic() >= next_s:
                next_s += 1.0 / RATE_HZ
                number += self._client is not None
                self._play(number)

    def _take(self, payload: bytes, peer: Address) -> None:
        try:
            message = decode(payload)
        except ProtocolError:
            return
        answer = None if isinstance(message, self._script.mute) else self._answer(message, peer)
        if answer is not None:
            self._replies.send(encode(answer, WRITTEN_IN), peer)

    def _answer(self, message: Message, peer: Address) -> Message | None:
        match message:
            case Connect() | Discovery():
                self._client = peer if isinstance(message, Connect) else self._client
                return self._info()
            case RequestModelDef():
                return self._script.definitions(self._reel.definitions)
            case Request():
                return UnrecognizedRequest()
            case EchoRequest():
                return EchoResponse(message.client_stamp, int(time.monotonic() * TICKS_HZ))
        return None

    def _info(self) -> ServerInfo:
        group = self._script.group
        connection = ConnectionInfo(TICKS_HZ, group[1] if group else 1511, int(group is not None), GROUP)
        return ServerInfo(Sender.named("broken", (1, 2, 0, 0), (*self._script.version, 0, 0)), connection)

    def _play(self, number: int) -> None:
        if self._client is None:
            return
        now = int(time.monotonic() * TICKS_HZ)
        data = replace(self._reel.frame(number % 50), number=number, ticks=Ticks(now - 2000, now - 1000, now))
        kept = self._script.frame(data)
        if kept is not None:
            octets = encode(kept, WRITTEN_IN) + self._script.tail
            self._sender.send(octets, self._script.sends_to or self._client)
        if number == self._script.ends_after:
            self._commands.send(encode(Disconnect()), self._client)


def without_frames(_: FrameOfData) -> None:
    """Keep every frame back."""


def losing_every_tenth(data: FrameOfData) -> FrameOfData | None:
    """Keep every tenth frame back."""
    return None if data.number % 10 == 0 else data


def without_labels(data: FrameOfData) -> FrameOfData:
    """The same points, none of them of any asset."""
    points = data.labelled.positions.copy()
    nobody = LabelledMarkers(data.labelled.table[:0])
    return replace(data, marker_sets=(), labelled=nobody, other_markers=points)


def all_occluded(data: FrameOfData) -> FrameOfData:
    """Every marker is there and not one is seen."""
    table = data.labelled.table.copy()
    table["params"] |= 1
    sets = tuple(replace(each, positions=np.zeros_like(each.positions)) for each in data.marker_sets)
    return replace(data, labelled=LabelledMarkers(table), marker_sets=sets)
