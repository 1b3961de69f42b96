"""Addresses of NatNet servers: ``natnet://HOST[:PORT][?multicast=GROUP|1&local=ADDRESS&data_port=1511&bitstream=4.1]``."""

from __future__ import annotations

from dataclasses import dataclass
from ipaddress import IPv4Address
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from retarget.errors import InputError, ProtocolError
from retarget.udp.natnet.version import Bitstream, parse_bitstream

if TYPE_CHECKING:
    from retarget.udp.natnet.messages import ConnectionInfo

COMMAND_PORT = 1510
DATA_PORT = 1511
MULTICAST_GROUP = "239.255.42.99"
DEFAULT_BITSTREAM = Bitstream(4, 1)
"""Asked of servers that can choose; older ones send what they know."""
_OPTIONS = ("multicast", "local", "data_port", "bitstream")


@dataclass(frozen=True, slots=True)
class NatNetUrl:
    """Where the server is and how its frames shall come."""

    host: str | None
    """Name or IPv4 address; None searches the network."""
    port: int = COMMAND_PORT
    multicast: bool = False
    """Join a group even when the server does not announce one."""
    group: str | None = None
    """Group to join in place of the announced one."""
    local: str | None = None
    """Address of ours to use; None takes the one that leads to the host."""
    data_port: int | None = None
    """Port of the group in place of the announced one."""
    bitstream: Bitstream = DEFAULT_BITSTREAM

    def group_for(self, announced: ConnectionInfo | None) -> tuple[str, int] | None:
        """Group and port to listen to, given what the server announces; None where frames come to each client."""
        wanted = self.multicast or (announced is not None and announced.is_multicast)
        return self.usual_group(announced) if wanted else None

    def usual_group(self, announced: ConnectionInfo | None) -> tuple[str, int]:
        """Group and port that the server would send to if it were set to multicast."""
        group = self.group or (announced.group if announced is not None else MULTICAST_GROUP)
        port = self.data_port or (announced.data_port if announced is not None and announced.data_port else DATA_PORT)
        return (MULTICAST_GROUP if group == "0.0.0.0" else group), port  # noqa: S104 - a 2.x server's empty field

    def __str__(self) -> str:
        return f"natnet://{self.host or ''}" + ("" if self.port == COMMAND_PORT else f":{self.port}")


def parse_natnet_url(url: str) -> NatNetUrl:
    """Read an address; raise `InputError` that names the part which cannot be used."""
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise InputError(f"{url!r} is not an address: {error}. Write natnet://HOST or natnet://HOST:PORT.") from error
    if parts.scheme != "natnet" or parts.path not in {"", "/"} or parts.username is not None or parts.fragment:
        raise InputError(f"{url!r} is not the address of a NatNet server. Write natnet://HOST or natnet://HOST:PORT.")
    options = _options(url, parts.query)
    multicast = options.get("multicast", "0")
    return NatNetUrl(
        host=parts.hostname or None,
        port=COMMAND_PORT if port is None else _port(url, str(port)),
        multicast=multicast != "0",
        group=None if multicast in {"0", "1"} else _ipv4(url, "multicast", multicast),
        local=_ipv4(url, "local", options["local"]) if "local" in options else None,
        data_port=_port(url, options["data_port"]) if "data_port" in options else None,
        bitstream=_bitstream(url, options["bitstream"]) if "bitstream" in options else DEFAULT_BITSTREAM,
    )


def _options(url: str, query: str) -> dict[str, str]:
    pairs = parse_qsl(query, keep_blank_values=True)
    options = dict(pairs)
    unknown = sorted(set(options) - set(_OPTIONS))
    if unknown or len(options) < len(pairs):
        wrong = f"the option {unknown[0]!r} is not known" if unknown else "an option is given twice"
        raise InputError(f"In {url!r} {wrong}; there are: {', '.join(_OPTIONS)}.")
    return options


def _port(url: str, text: str) -> int:
    if not (text.isascii() and text.isdigit() and 0 < int(text[:6]) < 65_536):
        raise InputError(f"In {url!r} the port {text!r} is not a number from 1 to 65535.")
    return int(text)


def _ipv4(url: str, option: str, text: str) -> str:
    try:
        return str(IPv4Address(text))
    except ValueError as error:
        raise InputError(f"In {url!r} {option}={text!r} is not an IPv4 address such as 192.168.1.10.") from error


def _bitstream(url: str, text: str) -> Bitstream:
    try:
        return parse_bitstream(text)
    except ProtocolError as error:
        raise InputError(f"In {url!r}: {error}") from error
