"""A client's side of a NatNet connection without its sockets: datagrams in, marker frames out, and what to send when.

Live, a source feeds it what arrives and sends what is due. Replaying a take, the recorded datagrams of both directions
are fed to it in their order, and what would be due is not asked for: the frames are the same, bit for bit.

Connect, learn the server's version, ask what it can tell, ask for the model definitions, read its clock: then frames
have names and times. From there on definitions are asked for again when a frame says that they changed, or shows it;
and the handshake is repeated when frames stop, stop making sense, or announce another bitstream.
"""

from __future__ import annotations

import logging
import math
from enum import Enum
from typing import TYPE_CHECKING

from retarget.errors import ConnectionFailedError, ProtocolError
from retarget.udp.natnet.codec import decode, encode
from retarget.udp.natnet.decoding import Decoding
from retarget.udp.natnet.definitions import DefinitionsWatch
from retarget.udp.natnet.echo import Echoes
from retarget.udp.natnet.framedata import FrameOfData
from retarget.udp.natnet.framing import Framing
from retarget.udp.natnet.messages import (
    Connect,
    ConnectionOptions,
    Disconnect,
    DisconnectByTimeout,
    EchoRequest,
    EchoResponse,
    MessageId,
    MessageString,
    Request,
    RequestModelDef,
    Response,
    Sender,
    ServerInfo,
    UnrecognizedRequest,
)
from retarget.udp.natnet.models import ModelDef
from retarget.udp.natnet.questions import BITSTREAM, FRAME_RATE, MILLIMETRES, Questions
from retarget.udp.natnet.records import FrameFlag
from retarget.udp.natnet.retry import Retry
from retarget.udp.natnet.url import DEFAULT_BITSTREAM
from retarget.udp.natnet.version import LATEST, OLDEST, Bitstream

if TYPE_CHECKING:
    from retarget.frames import MarkerFrame, MarkerLayout
    from retarget.udp.natnet.clock import EchoClock
    from retarget.udp.natnet.messages import Message

SILENCE_S = 2.0
"""Without a frame for so long, the server is connected again [s]; a server that answers but rests is left more time."""

PREPARE_S = 3.0
"""For so long, frames wait for their names; then they are handed on with numbers for names [s]."""

_LONGEST_SILENCE_S = 10.0
_OBSERVED = {MessageId.REQUEST, MessageId.ECHOREQUEST}  # of what is sent, what an answer refers to
_log = logging.getLogger("retarget.natnet")


class Phase(Enum):
    """How far a connection has come."""

    CONNECTING = "connecting"
    CONNECTED = "connected"
    ENDED = "ended"
    """The server took its leave; nothing more will come."""


class NatNetSession:
    """One server, from the first CONNECT to its DISCONNECT.

    `peer` is what messages call the server, `wanted` the bitstream asked for; None leaves it to the server, as clients
    that listen to a group must. Times are local monotonic seconds.
    """

    def __init__(self, peer: str = "the server", wanted: Bitstream | None = DEFAULT_BITSTREAM) -> None:
        self._peer = peer
        self._wanted = wanted
        self._decoding = Decoding(peer, wanted)
        self._framing = Framing()
        self._questions = Questions()
        self._definitions = DefinitionsWatch()
        self._echoes = Echoes()
        self._connecting = Retry(0.5, 6, 1.0)
        self._connect_wanted = True
        self._heard_s = math.inf  # the last frame, or the last time that a server was connected
        self._silence_s = SILENCE_S
        self._silent = False
        self._met_s = math.inf
        self._prepared = False
        self._flags = 0
        self.phase = Phase.CONNECTING
        self.server: ServerInfo | None = None
        self.reconnects = 0

    @property
    def framing(self) -> Framing:
        """Counts of frames."""
        return self._framing

    @property
    def bitstream(self) -> Bitstream | None:
        """The version that frames are read in; set it where a capture does not tell."""
        return self._decoding.bitstream

    @bitstream.setter
    def bitstream(self, bitstream: Bitstream) -> None:
        self._decoding.bitstream = bitstream

    @property
    def malformed(self) -> int:
        """Datagrams that do not follow the protocol."""
        return self._decoding.malformed

    @property
    def layout(self) -> MarkerLayout:
        """All markers known so far."""
        return self._framing.names.layout

    @property
    def rate_hz(self) -> float | None:
        """Frames per second, where the server told."""
        return self._questions.answers.rate_hz

    @property
    def clock(self) -> EchoClock | None:
        """The server's high-resolution clock, where it has one."""
        return self._echoes.clock

    def ready(self, now_s: float) -> bool:
        """Whether frames will have names, units and times."""
        prepared = self._questions.settled and self._definitions.known and self._echoes.settled(now_s)
        return self.phase is Phase.CONNECTED and prepared

    def due(self, now_s: float) -> list[bytes]:
        """Datagrams to send to the command port now; tell `sent` of each."""
        if self.phase is Phase.ENDED:
            return []
        if now_s - self._heard_s > self._silence_s:
            self._notice_silence(now_s)
        messages: list[Message | None] = []
        if self._connect_wanted and self._connecting.due(now_s):
            messages.append(self._connect())
        if self.phase is Phase.CONNECTED:
            messages += [self._questions.due(now_s), self._echoes.due(now_s)]
            if self._may_ask_definitions(now_s) and self._definitions.due(now_s):
                messages.append(RequestModelDef())
        return [encode(message) for message in messages if message is not None]

    def next_due_s(self, now_s: float) -> float:
        """When to ask `due` again, if nothing arrives."""
        times = [self._heard_s + self._silence_s]
        if self._connect_wanted:
            times.append(self._connecting.next_s)
        if self.phase is Phase.CONNECTED:
            times += [self._questions.next_s, self._echoes.next_s]
            if self._may_ask_definitions(now_s):
                times.append(self._definitions.next_s)
        return min(times)

    def _may_ask_definitions(self, now_s: float) -> bool:
        """They are asked for last: a server that waits for its client may begin to play then."""
        return self._questions.settled and self._echoes.settled(now_s)

    def sent(self, datagram: bytes, sent_s: float) -> None:
        """A datagram left for the server; answers will refer to it."""
        if int.from_bytes(datagram[:2], "little") not in _OBSERVED:
            return
        try:
            message = decode(datagram)
        except ProtocolError:  # what another client sent, in a capture
            return
        if isinstance(message, Request):
            self._questions.put(message.command, sent_s)
        elif isinstance(message, EchoRequest):
            self._echoes.sent(message, sent_s)

    def receive(self, datagram: bytes, received_s: float) -> MarkerFrame | None:
        """Take a datagram of the server; return the frame that it holds, if it holds one that is of use.

        What does not follow the protocol is counted in `malformed`. Raises `ConnectionFailedError` when the server's
        version is too old to be read.
        """
        message = self._decoding.read(datagram)
        if isinstance(message, FrameOfData):
            return self._on_frame(message, received_s)
        if message is not None:
            self._on_message(message, datagram, received_s)
        elif self._decoding.lost_track():
            self._reconnect()
        return None

    def _on_frame(self, data: FrameOfData, received_s: float) -> MarkerFrame | None:
        if self._silent:
            _log.warning("Frames from %s again.", self._peer)
        self._silent, self._heard_s, self._silence_s = False, received_s, SILENCE_S
        risen, self._flags = data.params & ~self._flags, data.params
        if risen & FrameFlag.BITSTREAM_CHANGED:
            self._reconnect()
        if risen & FrameFlag.MODELS_CHANGED:
            self._definitions.want()
        if not self._may_hand_on(received_s):
            return None
        if not self._framing.names.agrees_with(data):
            self._definitions.doubt(received_s)
        return self._framing.frame(data, received_s)

    def _may_hand_on(self, now_s: float) -> bool:
        """Whether frames have their names; those that come while a server is still asked for them are of no use.

        Where no server was met, as in a capture that began too late for it, nothing is waited for.
        """
        if not self._prepared:
            waited = self.server is None or now_s - self._met_s > PREPARE_S
            self._prepared = waited or self._definitions.known
        return self._prepared

    def _on_message(self, message: Message, datagram: bytes, received_s: float) -> None:
        match message:
            case ServerInfo():
                self._on_server_info(message, received_s)
            case ModelDef():
                self._on_definitions(message, datagram, received_s)
            case Response():
                self._on_answer(message)
            case UnrecognizedRequest():
                self._on_answer(None)
            case EchoResponse():
                self._echoes.answered(message, received_s)
            case Disconnect():
                _log.info("%s ended the stream.", self._peer)
                self.phase = Phase.ENDED
            case DisconnectByTimeout():
                self._reconnect()
            case MessageString():
                _log.info("%s says: %s", self._peer, message.text)
            case _:
                pass

    def _on_server_info(self, info: ServerInfo, now_s: float) -> None:
        if not self._connect_wanted and info == self.server:
            return  # the answer to a CONNECT that was repeated
        if info.sender.bitstream < OLDEST:
            self._refuse(info)
            return
        if info != self.server:
            self._meet(info, now_s)
            self._questions.begin(self._questions_for(info))
        elif self._definitions.known:  # else it is still asked for the first time
            self._questions.begin(self._questions_for(info))
        self._definitions.want()
        self._connect_wanted = False
        self._connecting.reset()
        self._heard_s = now_s
        self.phase = Phase.CONNECTED

    def _refuse(self, info: ServerInfo) -> None:
        """Fail as long as nothing was received; a stream that runs does not end over one strange answer."""
        message = (
            f"{self._peer} ({info.sender.name}) sends bitstream {info.sender.bitstream}, which is too old to be read; "
            f"update it to one that sends {OLDEST} or later."
        )
        if self.server is None:
            raise ConnectionFailedError(message)
        _log.warning("%s", message)

    def _meet(self, info: ServerInfo, now_s: float) -> None:
        """A server that was not known before, or one that changed."""
        version = info.sender.bitstream
        self._decoding.announced = version
        self.bitstream = version if version <= LATEST else self._wanted or LATEST
        self.server = info
        self._met_s, self._prepared = now_s, False
        self._definitions.forget()
        self._echoes.begin(info.connection.clock_hz if info.connection is not None else 0, now_s)
        self._framing.restart(self._echoes.clock)
        _log.info("%s is %s, bitstream %s.", self._peer, info.sender.name or "nameless", version)

    def _questions_for(self, info: ServerInfo) -> list[str]:
        unicast = self._wanted is not None and not (info.connection is not None and info.connection.is_multicast)
        return [*([BITSTREAM] if unicast and info.sender.bitstream >= (4, 0) else []), MILLIMETRES, FRAME_RATE]

    def _on_answer(self, response: Response | None) -> None:
        self._questions.answered(response)
        answers = self._questions.answers
        if answers.bitstream is not None:
            self.bitstream = answers.bitstream
        if answers.millimetres is not None:
            self._framing.metres = 1e-3 * answers.millimetres

    def _on_definitions(self, definitions: ModelDef, datagram: bytes, now_s: float) -> None:
        for note in definitions.notes:
            _log.warning("%s: %s", self._peer, note)
        self._heard_s = now_s
        if self._definitions.came(datagram, now_s):
            self._framing.describe(definitions)

    def _connect(self) -> Connect:
        own = (self._wanted or LATEST) + (0, 0)
        options = ConnectionOptions(0, (0, 0, 0, 0) if self._wanted is None else own)
        return Connect(Sender.named("retarget", (0, 1, 0, 0), own), options)

    def _reconnect(self) -> None:
        if not self._connect_wanted:
            self._connect_wanted = True
            self._connecting.reset()
            self.reconnects += 1

    def _notice_silence(self, now_s: float) -> None:
        """Connect again; the first time with a word about it."""
        if not self._silent:
            _log.warning("No frames from %s for %.0f s: is it paused or gone? Trying again.", self._peer, SILENCE_S)
        self._silent = True
        self._heard_s = now_s
        self._silence_s = min(2 * self._silence_s, _LONGEST_SILENCE_S)
        self._reconnect()
