"""A server's command channel without its socket: a datagram in, the answer out.

A client chooses its bitstream as it connects (4.0 and later) or with the request ``Bitstream,3.1``, up to the server's
own; servers older than 4.0 had one for all, and so has this one when it plays such a server. Strangers are answered
too, as clients ask much before they connect, but only so many bytes a second.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from retarget.errors import ProtocolError
from retarget.udp.natnet.clients import Allowance, Client, Clients
from retarget.udp.natnet.codec import decode, encode
from retarget.udp.natnet.messages import (
    Connect,
    Disconnect,
    Discovery,
    EchoRequest,
    EchoResponse,
    MessageId,
    Request,
    RequestFrameOfData,
    RequestModelDef,
    Response,
    Sender,
    ServerInfo,
    UnrecognizedRequest,
)
from retarget.udp.natnet.requests import answer_request
from retarget.udp.natnet.version import Bitstream, parse_bitstream, require_known

if TYPE_CHECKING:
    from retarget.udp.natnet.messages import ConnectionInfo, Message
    from retarget.udp.natnet.playback import Playback
    from retarget.udp.natnet.reel import Reel
    from retarget.udp.sockets import Address

_KEEP_ALIVE = int(MessageId.KEEPALIVE).to_bytes(2, "little")
_CHOICE_SINCE = Bitstream(4, 0)
_log = logging.getLogger("retarget.natnet")


class Responder:
    """Answers for one server. Not thread-safe: the caller holds a lock."""

    def __init__(
        self, reel: Reel, playback: Playback, bitstream: Bitstream, connection: ConnectionInfo, rate_hz: float
    ) -> None:
        self.reel = reel
        self._playback = playback
        self.bitstream = require_known(bitstream)
        self._connection = connection
        self._rate_hz = rate_hz
        self._strangers = Allowance()
        self._definitions: dict[Bitstream, bytes] = {}
        self.clients = Clients()
        self.malformed = 0

    def answer(self, datagram: bytes, peer: Address, now_s: float) -> bytes | None:
        """Take a datagram of `peer`; return what is to be sent back, if anything."""
        client = self.clients.hear(peer, now_s)
        if datagram.startswith(_KEEP_ALIVE):
            return None
        try:
            message = decode(datagram)
        except ProtocolError as error:
            self.malformed += 1
            _log.debug("A datagram of %d bytes from %s:%d is skipped: %s", len(datagram), *peer, error)
            return None
        reply = self._reply(message, peer, client, now_s)
        if reply is None or (client is None and not self._strangers.grants(len(reply), now_s)):
            return None
        return reply

    def definitions(self, bitstream: Bitstream) -> bytes:
        """The model definitions in one bitstream, written once."""
        if bitstream not in self._definitions:
            self._definitions[bitstream] = encode(self.reel.definitions, bitstream)
        return self._definitions[bitstream]

    def _reply(self, message: Message, peer: Address, client: Client | None, now_s: float) -> bytes | None:
        bitstream = client.bitstream if client is not None else self.bitstream
        match message:
            case Connect():
                return self._connect(message, peer, now_s)
            case Discovery():
                return encode(self._server_info(bitstream))
            case Request():
                return encode(self._on_request(message, client, bitstream))
            case RequestModelDef():
                if client is not None:
                    client.informed = True
                return self.definitions(bitstream)
            case RequestFrameOfData():
                index = min(self._playback.index, self._playback.last)
                return encode(self.reel.frame(index), bitstream)
            case EchoRequest():
                return encode(EchoResponse(message.client_stamp, int(now_s * self._connection.clock_hz)))
            case Disconnect():
                self.clients.remove(peer)
        return None

    def _connect(self, connect: Connect, peer: Address, now_s: float) -> bytes | None:
        known = self.clients.get(peer) is not None
        client = self.clients.connect(peer, self._chosen(connect), now_s)
        if client is None:
            return None
        if not known:
            _log.info("%s:%d connects, bitstream %s.", *peer, client.bitstream)
        return encode(self._server_info(client.bitstream))

    def _chosen(self, connect: Connect) -> Bitstream:
        wanted = connect.options.bitstream if connect.options is not None else None
        return self._agreed(wanted) if wanted is not None else self.bitstream

    def _agreed(self, wanted: Bitstream) -> Bitstream:
        """What a client gets that wants `wanted`."""
        if self.bitstream < _CHOICE_SINCE or self._connection.is_multicast:
            return self.bitstream
        try:
            return min(require_known(wanted), self.bitstream)
        except ProtocolError:
            return self.bitstream

    def _server_info(self, bitstream: Bitstream) -> ServerInfo:
        sender = Sender.named("retarget", (0, 1, 0, 0), (*bitstream, 0, 0))
        return ServerInfo(sender, self._connection if bitstream >= (3, 0) else None)

    def _on_request(
        self, request: Request, client: Client | None, bitstream: Bitstream
    ) -> Response | UnrecognizedRequest:
        if request.command != "Bitstream" or self.bitstream < _CHOICE_SINCE:
            return answer_request(request, self._playback, self._rate_hz * self._playback.speed)
        if not request.parameters:
            return Response.of_text(f"Bitstream,{bitstream}")
        try:
            wanted = parse_bitstream(request.parameters[0])
        except ProtocolError:
            return Response.of_int32(1)
        if client is None or self._agreed(wanted) != wanted:
            return Response.of_int32(1)
        client.bitstream = wanted
        return Response.of_int32(0)
