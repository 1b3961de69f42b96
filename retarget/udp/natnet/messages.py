"""Every NatNet message as a frozen value; what it says, not how it is written.

FRAMEOFDATA is `framedata.FrameOfData`, MODELDEF `models.ModelDef`; all others are here. What senders leave behind in
fields (stale memory after a name, a NUL after an empty message) is kept, so that a value writes the very bytes that it
was read from. Source: NatNetTypes.h and NatNetRequests.h of the vendor's SDKs 2.5 to 4.3, and a captured session of
Motive 2.1.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import TypeAlias

from retarget.errors import InputError
from retarget.udp.natnet.framedata import FrameOfData
from retarget.udp.natnet.models import ModelDef
from retarget.udp.natnet.text import octets_from_text, text_from_octets
from retarget.udp.natnet.version import Bitstream

FourNumbers: TypeAlias = tuple[int, int, int, int]
"""A version as major, minor, build, revision, 0 to 255 each."""

NAME_OCTETS = 256


class MessageId(IntEnum):
    """First two bytes of every datagram."""

    CONNECT = 0
    SERVERINFO = 1
    REQUEST = 2
    RESPONSE = 3
    REQUEST_MODELDEF = 4
    MODELDEF = 5
    REQUEST_FRAMEOFDATA = 6
    FRAMEOFDATA = 7
    MESSAGESTRING = 8
    DISCONNECT = 9
    KEEPALIVE = 10
    DISCONNECTBYTIMEOUT = 11
    ECHOREQUEST = 12
    ECHORESPONSE = 13
    DISCOVERY = 14
    UNRECOGNIZED_REQUEST = 100


@dataclass(frozen=True, slots=True)
class Sender:
    """Who speaks: the application and the two versions of it."""

    name_field: bytes
    """256 bytes: the name, a NUL, and whatever the sender's memory held behind it."""
    app_version: FourNumbers
    natnet_version: FourNumbers
    """Of a server: the bitstream it sends unless asked for another."""

    @classmethod
    def named(cls, name: str, app_version: FourNumbers, natnet_version: FourNumbers) -> Sender:
        """Make one; raise `InputError` when the name is longer than 255 bytes of UTF-8."""
        octets = octets_from_text(name)
        if len(octets) >= NAME_OCTETS:
            raise InputError(f"The application name {name[:20]!r}... is too long; at most {NAME_OCTETS - 1} bytes fit.")
        return cls(octets.ljust(NAME_OCTETS, b"\0"), app_version, natnet_version)

    @property
    def name(self) -> str:
        """The name, up to the first NUL."""
        return text_from_octets(self.name_field.partition(b"\0")[0])

    @property
    def bitstream(self) -> Bitstream:
        """Major and minor of `natnet_version`; not checked to be one that is known."""
        return Bitstream(*self.natnet_version[:2])


@dataclass(frozen=True, slots=True)
class ConnectionOptions:
    """What a client of 4.0 and later asks for as it connects."""

    subscribed_data_only: int
    """0 or 1: send only what was subscribed to by name."""
    bitstream_version: FourNumbers
    """0.0.0.0: whatever the server sends."""

    @property
    def bitstream(self) -> Bitstream | None:
        """The version asked for, None for the server's own; not checked to be one that is known."""
        wanted = Bitstream(*self.bitstream_version[:2])
        return None if wanted == (0, 0) else wanted


@dataclass(frozen=True, slots=True)
class Connect:
    """CONNECT (0), in any of its four forms: empty, a greeting ("Ping"), a sender, a sender with options."""

    sender: Sender | None = None
    options: ConnectionOptions | None = None
    extra: bytes = b""
    """Without a sender the greeting as it came; with options the NULs that some clients send behind them."""


@dataclass(frozen=True, slots=True)
class Discovery:
    """DISCOVERY (14), broadcast to the command port; the answer is a SERVERINFO. The same forms as CONNECT."""

    sender: Sender | None = None
    options: ConnectionOptions | None = None
    extra: bytes = b""
    """As in `Connect`."""


@dataclass(frozen=True, slots=True)
class ConnectionInfo:
    """Where a server's frames come from and how fast its clock ticks; only servers of 3.0 and later say so."""

    clock_hz: int
    """Ticks per second of every time stamp in ticks."""
    data_port: int
    multicast_flag: int
    """0 or 1."""
    group: str
    """Multicast address, "239.255.42.99"."""

    @property
    def is_multicast(self) -> bool:
        """Frames go to `group`, not to each client."""
        return self.multicast_flag != 0


@dataclass(frozen=True, slots=True)
class ServerInfo:
    """SERVERINFO (1), the answer to CONNECT and DISCOVERY."""

    sender: Sender
    connection: ConnectionInfo | None = None
    """None from a server before 3.0: default ports, no clock."""


@dataclass(frozen=True, slots=True)
class Request:
    """REQUEST (2): a command with parameters, "SetProperty,,Exposure,250"."""

    octets: bytes
    """The payload, its closing NUL included; bytes of unknown meaning in some clients' private requests."""

    @classmethod
    def of(cls, command: str, *parameters: object) -> Request:
        """Make one; parameters are joined with commas as they print."""
        text = ",".join([command, *(str(parameter) for parameter in parameters)])
        return cls(octets_from_text(text) + b"\0")

    @property
    def text(self) -> str:
        """The whole request, up to the first NUL."""
        return text_from_octets(self.octets.partition(b"\0")[0])

    @property
    def command(self) -> str:
        """What stands before the first comma."""
        return self.text.partition(",")[0]

    @property
    def parameters(self) -> tuple[str, ...]:
        """What stands between and behind the commas."""
        return tuple(self.text.split(",")[1:])


@dataclass(frozen=True, slots=True)
class Response:
    """RESPONSE (3): four bytes that are a status or a number, or text; only the request tells which."""

    octets: bytes

    @classmethod
    def of_int32(cls, value: int) -> Response:
        """Answer a status, 0 for success, or a whole number."""
        return cls(struct.pack("<i", value))

    @classmethod
    def of_float32(cls, value: float) -> Response:
        """Answer a number such as the frame rate."""
        return cls(struct.pack("<f", value))

    @classmethod
    def of_text(cls, text: str) -> Response:
        """Answer text, closed with a NUL."""
        return cls(octets_from_text(text) + b"\0")

    @property
    def int32(self) -> int | None:
        """The status or whole number; None unless there are exactly four bytes."""
        return int.from_bytes(self.octets, "little", signed=True) if len(self.octets) == 4 else None

    @property
    def float32(self) -> float | None:
        """The number; None unless there are exactly four bytes."""
        return float(struct.unpack("<f", self.octets)[0]) if len(self.octets) == 4 else None

    @property
    def text(self) -> str:
        """The text, with or without a closing NUL: some servers leave it out, so that "true" looks like a number."""
        return text_from_octets(self.octets.partition(b"\0")[0])


@dataclass(frozen=True, slots=True)
class RequestModelDef:
    """REQUEST_MODELDEF (4)."""

    padding: bytes = b""
    """Nothing, or the one NUL that some clients send."""


@dataclass(frozen=True, slots=True)
class RequestFrameOfData:
    """REQUEST_FRAMEOFDATA (6)."""

    padding: bytes = b""
    """As in `RequestModelDef`."""


@dataclass(frozen=True, slots=True)
class Disconnect:
    """DISCONNECT (9)."""

    padding: bytes = b""
    """As in `RequestModelDef`."""


@dataclass(frozen=True, slots=True)
class KeepAlive:
    """KEEPALIVE (10): a unicast client is still there."""

    padding: bytes = b""
    """As in `RequestModelDef`."""


@dataclass(frozen=True, slots=True)
class DisconnectByTimeout:
    """DISCONNECTBYTIMEOUT (11): the server gave a silent client up."""

    padding: bytes = b""
    """As in `RequestModelDef`."""


@dataclass(frozen=True, slots=True)
class MessageString:
    """MESSAGESTRING (8): a line for a person to read."""

    octets: bytes

    @property
    def text(self) -> str:
        """The line, up to the first NUL."""
        return text_from_octets(self.octets.partition(b"\0")[0])


@dataclass(frozen=True, slots=True)
class EchoRequest:
    """ECHOREQUEST (12), for clock synchronisation."""

    client_stamp: int
    """The client's own clock, any unit, 64 bits unsigned."""


@dataclass(frozen=True, slots=True)
class EchoResponse:
    """ECHORESPONSE (13)."""

    client_stamp: int
    """As it came."""
    server_ticks: int
    """The server's clock as it answered, in ticks of `ConnectionInfo.clock_hz`."""


@dataclass(frozen=True, slots=True)
class UnrecognizedRequest:
    """UNRECOGNIZED_REQUEST (100): the server does not know the request."""

    octets: bytes = b""
    """Motive sends a sender's 264 bytes; nothing in them is of use."""


@dataclass(frozen=True, slots=True)
class Unknown:
    """A datagram of unknown id, kept as it is: a newer server's message is not an error, and a take keeps it."""

    id: int
    payload: bytes


Message: TypeAlias = (
    Connect
    | ServerInfo
    | Request
    | Response
    | RequestModelDef
    | ModelDef
    | RequestFrameOfData
    | FrameOfData
    | MessageString
    | Disconnect
    | KeepAlive
    | DisconnectByTimeout
    | EchoRequest
    | EchoResponse
    | Discovery
    | UnrecognizedRequest
    | Unknown
)
