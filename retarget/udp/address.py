"""Addresses of streams as a user writes them: ``udp://HOST:PORT``, ``tcp://HOST:PORT``."""

from __future__ import annotations

from urllib.parse import urlsplit

from retarget.errors import InputError
from retarget.udp.sockets import LOOPBACK, Address, resolve


def parse_address(url: str, scheme: str, default_port: int | None = None) -> Address:
    """IPv4 address and port of `url`; without a host it is the loopback address.

    InputError where it cannot be read, `ConnectionFailedError` for a host that nobody knows.
    """
    example = f"{scheme}://HOST:{default_port or 'PORT'}"
    try:
        parts = urlsplit(url)
        port = parts.port if parts.port is not None else default_port
    except ValueError as error:
        raise InputError(f"{url!r} is not an address: {error}. Write {example}.") from error
    extra = parts.path not in {"", "/"} or parts.query or parts.fragment or parts.username is not None
    if parts.scheme != scheme or extra:
        raise InputError(f"{url!r} is not an address of this kind. Write {example}.")
    if port is None:
        raise InputError(f"{url!r} names no port. Write {example}.")
    return (resolve(parts.hostname) if parts.hostname else LOOPBACK), port
