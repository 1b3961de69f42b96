"""Who listens to a server, in which bitstream, and how much may be said to those who do not."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from retarget.udp.natnet.version import Bitstream

    Address = tuple[str, int]

MAX_CLIENTS = 32
SILENCE_S = 5.0
"""A client that says nothing for so long has gone; clients speak about once a second."""
UNPROVEN_S = 2.5
"""One that said nothing after its CONNECT may not even know of us: somebody else may have written its address."""


@dataclass(slots=True)
class Client:
    """One unicast listener."""

    address: Address
    bitstream: Bitstream
    connected_s: float
    heard_s: float
    proven: bool = False
    """It said something after its CONNECT."""
    informed: bool = False
    """It was sent the model definitions."""

    def expires_s(self) -> float:
        """When it counts as gone, local monotonic [s]."""
        return self.heard_s + (SILENCE_S if self.proven else UNPROVEN_S)


class Clients:
    """At most `MAX_CLIENTS`. Times are told, local monotonic [s]."""

    def __init__(self) -> None:
        self._by_address: dict[Address, Client] = {}
        self.refused = 0
        """CONNECTs that found no room."""

    def __len__(self) -> int:
        return len(self._by_address)

    def get(self, address: Address) -> Client | None:
        """The client at `address`."""
        return self._by_address.get(address)

    def connect(self, address: Address, bitstream: Bitstream, now_s: float) -> Client | None:
        """Add a client, or change the bitstream of one; None when there is no room."""
        client = self._by_address.get(address)
        if client is None:
            if len(self) >= MAX_CLIENTS:
                self.refused += 1
                return None
            client = self._by_address[address] = Client(address, bitstream, now_s, now_s)
        client.bitstream, client.heard_s = bitstream, now_s
        return client

    def hear(self, address: Address, now_s: float) -> Client | None:
        """Note that `address` spoke; return the client that it is, if it is one."""
        client = self._by_address.get(address)
        if client is not None:
            client.heard_s = now_s
            client.proven = True
        return client

    def remove(self, address: Address) -> None:
        """Forget a client that took its leave."""
        self._by_address.pop(address, None)

    def expire(self, now_s: float) -> list[Client]:
        """Forget those that were silent too long, and return them."""
        gone = [client for client in self._by_address.values() if client.expires_s() < now_s]
        for client in gone:
            self.remove(client.address)
        return gone

    def addresses(self) -> list[Address]:
        """All of them."""
        return list(self._by_address)

    def by_bitstream(self) -> dict[Bitstream, list[Address]]:
        """Addresses of those that want the same bytes."""
        groups: dict[Bitstream, list[Address]] = {}
        for client in self._by_address.values():
            groups.setdefault(client.bitstream, []).append(client.address)
        return groups

    def anyone_ready(self, now_s: float, grace_s: float) -> bool:
        """Whether somebody has the model definitions, or was connected for `grace_s` and does not ask for them."""
        clients = self._by_address.values()
        return any(client.informed or now_s - client.connected_s >= grace_s for client in clients)


class Allowance:
    """Bytes that may be sent to strangers: `rate` a second, `most` at once; a question may carry a forged address."""

    def __init__(self, rate: float = 32_768.0, most: float = 131_072.0) -> None:
        self._rate, self._most = rate, most
        self._left = most
        self._since_s = math.inf

    def grants(self, size: int, now_s: float) -> bool:
        """Whether `size` bytes may be sent; if so, they are counted."""
        self._left = min(self._most, self._left + self._rate * max(0.0, now_s - self._since_s))
        self._since_s = now_s
        if size > self._left:
            return False
        self._left -= size
        return True
