"""Local and remote addresses: names, network cards, what stands in the way of using one."""

from __future__ import annotations

import contextlib
import errno
import socket
import struct
import sys
from ipaddress import ip_address

from retarget.errors import ConnectionFailedError

Address = tuple[str, int]
"""IPv4 address in dotted form, and port."""

LOOPBACK = "127.0.0.1"
LINUX = sys.platform == "linux"
_SIOCGIFADDR = 0x8915  # linux: linux/sockios.h
_IFREQ = struct.Struct("16s4x4s16x")


def resolve(host: str) -> str:
    """IPv4 address of a host name; raise `ConnectionFailedError` when there is none."""
    try:
        found = socket.getaddrinfo(host, None, socket.AF_INET, socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        raise ConnectionFailedError(
            f"The host {host!r} is not known: give its IPv4 address, or check the spelling and the name service."
        ) from error
    return str(found[0][4][0])


def local_address_towards(host: str) -> str:
    """The address of ours from which `host` (an IPv4 address) is reached; sends nothing."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((host, 9))
        except OSError as error:
            raise ConnectionFailedError(
                f"No network leads to {host}: {reason(error)}. Check the cable and the address."
            ) from error
        return str(probe.getsockname()[0])


def local_addresses() -> list[str]:
    """IPv4 addresses of this machine, one for each network card (Linux; elsewhere none)."""
    if not LINUX:
        return []
    import fcntl

    found = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        for _, name in socket.if_nameindex():
            with contextlib.suppress(OSError):  # a card without an address
                answer = fcntl.ioctl(asking, _SIOCGIFADDR, _IFREQ.pack(name.encode(), bytes(4)))
                found.append(socket.inet_ntoa(_IFREQ.unpack(answer)[1]))
    return found


def broadcast_address(local: str) -> str:
    """Where everybody on the network of `local` is reached."""
    return "127.255.255.255" if is_loopback(local) else "255.255.255.255"


def is_loopback(host: str) -> bool:
    """Whether an IPv4 address never leaves this machine."""
    return ip_address(host).is_loopback


def bind(unbound: socket.socket, address: Address) -> None:
    """Bind, or close it and raise `ConnectionFailedError` with what to do."""
    host, port = address
    try:
        unbound.bind(address)
    except OSError as error:
        unbound.close()
        raise ConnectionFailedError(f"Cannot use {host}:{port}: {advice(error, host, port)}.") from error


def advice(error: OSError, host: str, port: int) -> str:
    """What stands in the way of using an address, and what to do."""
    if error.errno == errno.EADDRINUSE:
        return f"port {port} is in use; stop the program that uses it, or choose another port"
    if error.errno in {errno.EACCES, errno.EPERM}:
        return f"port {port} needs more rights; choose one above 1023"
    if error.errno == errno.EADDRNOTAVAIL or isinstance(error, socket.gaierror):
        return f"{host} is not an address of this machine; give one of its own, such as {LOOPBACK}"
    return reason(error)


def reason(error: OSError) -> str:
    """The system's own words."""
    return (error.strerror or str(error)).rstrip(".").lower()
