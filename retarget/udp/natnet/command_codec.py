"""The messages of the command channel, from bytes and to bytes; the same in all bitstream versions.

Forms that real clients send and that are accepted: CONNECT as four bytes, with "Ping" and a NUL, with a sender, and
with a sender and options, behind which up to `MAX_PADDING` NULs may follow (the vendor's sample sends two); one NUL
after a message that should be empty. Anything else behind the end of a message is refused.
"""

from __future__ import annotations

import struct
from ipaddress import AddressValueError, IPv4Address
from typing import TYPE_CHECKING, Any, TypeVar

from retarget.errors import InputError, ProtocolError
from retarget.udp.natnet.messages import (
    NAME_OCTETS,
    Connect,
    ConnectionInfo,
    ConnectionOptions,
    Disconnect,
    DisconnectByTimeout,
    Discovery,
    EchoRequest,
    EchoResponse,
    KeepAlive,
    MessageId,
    MessageString,
    Request,
    RequestFrameOfData,
    RequestModelDef,
    Response,
    Sender,
    ServerInfo,
    UnrecognizedRequest,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from retarget.udp.natnet.messages import Message
    from retarget.udp.natnet.reader import Cursor
    from retarget.udp.natnet.writer import Writer

Hello = TypeVar("Hello", Connect, Discovery)
Bare = TypeVar("Bare", RequestModelDef, RequestFrameOfData, Disconnect, KeepAlive, DisconnectByTimeout)

MAX_PADDING = 8

_SENDER = struct.Struct(f"<{NAME_OCTETS}s4B4B")
_OPTIONS = struct.Struct("<B4B")
_CONNECTION = struct.Struct("<QHB4s")
_STAMP = struct.Struct("<Q")
_STAMPS = struct.Struct("<QQ")


def _read_sender(cursor: Cursor) -> Sender:
    name, *numbers = cursor.unpack(_SENDER)
    app, natnet = numbers[:4], numbers[4:]
    return Sender(name, (app[0], app[1], app[2], app[3]), (natnet[0], natnet[1], natnet[2], natnet[3]))


def _read_hello(cursor: Cursor, kind: type[Hello]) -> Hello:
    if cursor.left < _SENDER.size:
        return kind(extra=_greeting(cursor.rest()))
    sender = _read_sender(cursor)
    if cursor.left == 0:
        return kind(sender)
    flag, a, b, c, d = cursor.unpack(_OPTIONS)
    return kind(sender, ConnectionOptions(flag, (a, b, c, d)), _padding(cursor.rest(), MAX_PADDING))


def _greeting(octets: bytes) -> bytes:
    if octets and octets.find(b"\0") != len(octets) - 1:
        raise ProtocolError(f"A connecting client's {len(octets)} bytes are neither a greeting nor a sender.")
    return octets


def _padding(octets: bytes, most: int) -> bytes:
    if len(octets) > most or octets.strip(b"\0"):
        raise ProtocolError(
            f"{len(octets)} bytes follow the end of the message; at most {most} zero bytes are allowed."
        )
    return octets


def _read_server_info(cursor: Cursor) -> ServerInfo:
    sender = _read_sender(cursor)
    if cursor.left == 0:
        return ServerInfo(sender)
    clock_hz, port, multicast, group = cursor.unpack(_CONNECTION)
    cursor.finish()
    return ServerInfo(sender, ConnectionInfo(clock_hz, port, multicast, str(IPv4Address(group))))


def _read_echo_request(cursor: Cursor) -> EchoRequest:
    request = EchoRequest(*cursor.unpack(_STAMP))
    cursor.finish()
    return request


def _read_echo_response(cursor: Cursor) -> EchoResponse:
    response = EchoResponse(*cursor.unpack(_STAMPS))
    cursor.finish()
    return response


def _read_bare(cursor: Cursor, kind: type[Bare]) -> Bare:
    return kind(_padding(cursor.rest(), 1))


READERS: dict[int, Callable[[Cursor], Message]] = {
    MessageId.CONNECT: lambda cursor: _read_hello(cursor, Connect),
    MessageId.SERVERINFO: _read_server_info,
    MessageId.REQUEST: lambda cursor: Request(cursor.rest()),
    MessageId.RESPONSE: lambda cursor: Response(cursor.rest()),
    MessageId.REQUEST_MODELDEF: lambda cursor: _read_bare(cursor, RequestModelDef),
    MessageId.REQUEST_FRAMEOFDATA: lambda cursor: _read_bare(cursor, RequestFrameOfData),
    MessageId.MESSAGESTRING: lambda cursor: MessageString(cursor.rest()),
    MessageId.DISCONNECT: lambda cursor: _read_bare(cursor, Disconnect),
    MessageId.KEEPALIVE: lambda cursor: _read_bare(cursor, KeepAlive),
    MessageId.DISCONNECTBYTIMEOUT: lambda cursor: _read_bare(cursor, DisconnectByTimeout),
    MessageId.ECHOREQUEST: _read_echo_request,
    MessageId.ECHORESPONSE: _read_echo_response,
    MessageId.DISCOVERY: lambda cursor: _read_hello(cursor, Discovery),
    MessageId.UNRECOGNIZED_REQUEST: lambda cursor: UnrecognizedRequest(cursor.rest()),
}
"""How the payload of each message is read to its end, but for the two that need a version."""


def _write_sender(out: Writer, sender: Sender) -> None:
    if len(sender.name_field) != NAME_OCTETS:
        raise InputError(
            f"A sender's name field has {NAME_OCTETS} bytes, not {len(sender.name_field)}; see Sender.named."
        )
    out.pack(_SENDER, sender.name_field, *sender.app_version, *sender.natnet_version)


def _write_hello(out: Writer, hello: Connect | Discovery) -> None:
    sender, options = hello.sender, hello.options
    if (sender is None and options is not None) or (sender is not None and options is None and hello.extra):
        raise InputError("Options follow a sender, and extra bytes follow options; give what comes first too.")
    if sender is not None:
        _write_sender(out, sender)
    if options is not None:
        out.pack(_OPTIONS, options.subscribed_data_only, *options.bitstream_version)
    out.octets(hello.extra)


def _write_server_info(out: Writer, info: ServerInfo) -> None:
    _write_sender(out, info.sender)
    connection = info.connection
    if connection is not None:
        group = _group(connection.group)
        out.pack(_CONNECTION, connection.clock_hz, connection.data_port, connection.multicast_flag, group)


def _group(address: str) -> bytes:
    try:
        return IPv4Address(address).packed
    except AddressValueError:
        raise InputError(f"{address!r} is not an IPv4 address; give one such as 239.255.42.99.") from None


def _write_padding(
    out: Writer, bare: RequestModelDef | RequestFrameOfData | Disconnect | KeepAlive | DisconnectByTimeout
) -> None:
    out.octets(bare.padding)


def _write_octets(out: Writer, message: Request | Response | MessageString | UnrecognizedRequest) -> None:
    out.octets(message.octets)


WRITERS: dict[type, tuple[MessageId, Callable[[Writer, Any], None]]] = {
    Connect: (MessageId.CONNECT, _write_hello),
    ServerInfo: (MessageId.SERVERINFO, _write_server_info),
    Request: (MessageId.REQUEST, _write_octets),
    Response: (MessageId.RESPONSE, _write_octets),
    RequestModelDef: (MessageId.REQUEST_MODELDEF, _write_padding),
    RequestFrameOfData: (MessageId.REQUEST_FRAMEOFDATA, _write_padding),
    MessageString: (MessageId.MESSAGESTRING, _write_octets),
    Disconnect: (MessageId.DISCONNECT, _write_padding),
    KeepAlive: (MessageId.KEEPALIVE, _write_padding),
    DisconnectByTimeout: (MessageId.DISCONNECTBYTIMEOUT, _write_padding),
    EchoRequest: (MessageId.ECHOREQUEST, lambda out, echo: out.pack(_STAMP, echo.client_stamp)),
    EchoResponse: (MessageId.ECHORESPONSE, lambda out, echo: out.pack(_STAMPS, echo.client_stamp, echo.server_ticks)),
    Discovery: (MessageId.DISCOVERY, _write_hello),
    UnrecognizedRequest: (MessageId.UNRECOGNIZED_REQUEST, _write_octets),
}
"""How each of these messages is written, and under which id."""
