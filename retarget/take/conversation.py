"""What must be known before the first frame of a take can be read: who sent it, its bitstream, the names.

A client that starts to listen is told all this a moment after its first frames, and a capture may begin in the middle
of a session. So the whole take is looked through for it, and it is told to the decoder before the first frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from retarget.errors import InputError, ProtocolError
from retarget.udp.natnet.codec import decode
from retarget.udp.natnet.messages import Connect, MessageId
from retarget.udp.natnet.session import NatNetSession
from retarget.udp.natnet.version import LATEST, OLDEST, Bitstream, require_known

if TYPE_CHECKING:
    from collections.abc import Iterator

    from retarget.take.reader import Take
    from retarget.udp.datagram import Datagram

_FRAMES_FOR_GUESSING: Final = 20
_VERSIONS: Final = tuple(
    Bitstream(*v)
    for v in ((4, 3), (4, 2), (4, 1), (4, 0), (3, 1), (3, 0), (2, 10), (2, 9), (2, 8), (2, 7), (2, 6), (2, 5))
)


@dataclass(frozen=True, slots=True)
class Conversation:
    """One server's part of a take."""

    server: str
    """Its address."""
    wanted: Bitstream | None
    """The bitstream that the client asked for, or that was guessed where the take holds no SERVERINFO."""
    guessed: bool
    """Whether the take does not say its bitstream."""
    told_first: tuple[Datagram, ...]
    """SERVERINFO and MODELDEF where they stand behind the first frame, which needs them."""

    def session(self, take: Take) -> NatNetSession:
        """A decoder that knows what the server says in this take."""
        session = NatNetSession(self.server, self.wanted)
        if self.guessed and self.wanted is not None:
            session.bitstream = self.wanted
        for datagram in self.told_first:
            session.receive(datagram.payload, take.start_s)
        return session

    def datagrams(self, take: Take) -> Iterator[Datagram]:
        """Those that went between the server and its client, in their order."""
        return (datagram for datagram in take if datagram.peer[0] == self.server)


def find_conversation(take: Take) -> Conversation:
    """Look through `take` for the server that sent its first frame.

    Raises InputError where there is no frame, or none that any known bitstream explains.
    """
    found = _Search()
    commands = take.counts.get("command", 0)
    for datagram in take:
        commands -= datagram.channel == "command"
        found.look_at(datagram)
        if found.complete or (commands <= 0 and len(found.frames) == _FRAMES_FOR_GUESSING):
            break
    server = found.server
    if server is None:
        raise InputError(f"{take.path} holds {sum(take.counts.values())} datagrams, but no frame of marker data")
    info = found.first.get((server, MessageId.SERVERINFO))
    wanted = found.wanted if info is not None else _guess(take, found.frames)
    return Conversation(server, wanted, guessed=info is None, told_first=found.told_first())


class _Search:
    """Gathers what a conversation consists of."""

    def __init__(self) -> None:
        self.server: str | None = None
        self.frames: list[bytes] = []
        """The server's first frames."""
        self.first: dict[tuple[str, int], Datagram] = {}
        """The first SERVERINFO and MODELDEF of each server."""
        self.wanted: Bitstream | None = None
        self._is_late = False

    @property
    def complete(self) -> bool:
        """Nothing more can be learnt."""
        wanted = (MessageId.SERVERINFO, MessageId.MODELDEF)
        return self.server is not None and all((self.server, kind) in self.first for kind in wanted)

    def look_at(self, datagram: Datagram) -> None:
        """Take one datagram."""
        kind = int.from_bytes(datagram.payload[:2], "little")
        if datagram.direction == "out":
            self._note_wish(kind, datagram.payload)
        elif kind == MessageId.FRAMEOFDATA:
            self.server = self.server or datagram.peer[0]
            if datagram.peer[0] == self.server and len(self.frames) < _FRAMES_FOR_GUESSING:
                self.frames.append(datagram.payload)
        elif kind in (MessageId.SERVERINFO, MessageId.MODELDEF):
            self._note_once(datagram, kind)

    def told_first(self) -> tuple[Datagram, ...]:
        """SERVERINFO and MODELDEF, as far as they were found, where one came too late for the first frame."""
        kinds = (MessageId.SERVERINFO, MessageId.MODELDEF)
        told = [self.first[key] for kind in kinds if self.server and (key := (self.server, kind)) in self.first]
        return tuple(told) if self._is_late else ()

    def _note_once(self, datagram: Datagram, kind: int) -> None:
        key = (datagram.peer[0], kind)
        if key not in self.first:
            self.first[key] = datagram
            self._is_late |= datagram.peer[0] == self.server

    def _note_wish(self, kind: int, payload: bytes) -> None:
        if kind != MessageId.CONNECT or self.wanted is not None:
            return
        try:
            message = decode(payload)
            if isinstance(message, Connect) and message.options is not None and message.options.bitstream is not None:
                self.wanted = require_known(message.options.bitstream)
        except ProtocolError:
            return


def _guess(take: Take, frames: list[bytes]) -> Bitstream:
    """The newest bitstream in which most of `frames` make sense, as the take does not say it."""
    readable = {version: sum(_reads(payload, version) for payload in frames) for version in _VERSIONS}
    best = max(readable, key=lambda version: readable[version])
    if not readable[best]:
        raise InputError(
            f"{take.path}: its frames make no sense in any bitstream from {OLDEST} to {LATEST}, and the take does not "
            "hold the server's answer to CONNECT, which says which it is; record from before the client connects"
        )
    return best


def _reads(payload: bytes, version: Bitstream) -> bool:
    try:
        decode(payload, version)
    except ProtocolError:
        return False
    return True
