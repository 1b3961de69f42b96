"""Ways to bend a datagram: each takes a source of randomness and bytes, and gives other bytes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.udp.natnet.strategies import EXTREMES

if TYPE_CHECKING:
    import random


def _flip_bit(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data)) if data else 0
    return data[:at] + bytes(b ^ (1 << rng.randrange(8)) for b in data[at : at + 1]) + data[at + 1 :]


def _overwrite(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data) + 1)
    new = rng.randbytes(rng.randrange(1, 8))
    return data[:at] + new + data[at + len(new) :]


def _write_extreme(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(4, len(data) + 1) if len(data) > 4 else len(data)
    return data[:at] + rng.choice(EXTREMES) + data[at + 4 :]


def _write_small_number(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(4, len(data) + 1) if len(data) > 4 else len(data)
    return data[:at] + rng.randrange(64).to_bytes(4, "little") + data[at + 4 :]


def _cut(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _append(rng: random.Random, data: bytes) -> bytes:
    return data + rng.choice((bytes, rng.randbytes))(rng.randrange(1, 40))


def _remove(rng: random.Random, data: bytes) -> bytes:
    start = rng.randrange(len(data) + 1)
    return data[:start] + data[start + rng.randrange(1, 30) :]


def _repeat(rng: random.Random, data: bytes) -> bytes:
    start = rng.randrange(len(data) + 1)
    stop = start + rng.randrange(1, 60)
    return data[:stop] + data[start:]


def _insert(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.randbytes(rng.randrange(1, 20)) + data[at:]


def _other_message(rng: random.Random, data: bytes) -> bytes:
    return rng.randrange(16).to_bytes(2, "little") + data[2:]


DISTORTIONS = (
    _flip_bit,
    _overwrite,
    _write_extreme,
    _write_small_number,
    _cut,
    _append,
    _remove,
    _repeat,
    _insert,
    _other_message,
)
