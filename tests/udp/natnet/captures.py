"""Datagrams that real servers and clients sent, read where the recordings lie; tests skip where they do not."""

from __future__ import annotations

import re
import struct
from functools import lru_cache
from pathlib import Path

import pytest

from retarget.udp.natnet.version import Bitstream

FOLDER = Path(__file__).parents[3] / "../shared/data/natnet"
SESSION = FOLDER / "motive-2.1_natnet-3.0_session.pcapng"
VENDOR_OUTPUT = FOLDER / "motive-2.1_natnet-3.0_vendor-client-output.txt"
OCCLUDED = FOLDER / "natnet-3.0_frame_occluded.bin"

needs_captures = pytest.mark.skipif(not SESSION.exists(), reason=f"the NatNet captures are not at {FOLDER}")

SESSION_VERSION = Bitstream(3, 0)
_ENHANCED_PACKET = 6
_ETHERNET = 14
_UDP = 8


@lru_cache(maxsize=1)
def session() -> tuple[bytes, ...]:
    """All UDP payloads of the recorded session, in order: Ethernet, IPv4."""
    capture = SESSION.read_bytes()
    payloads = []
    at = 0
    while at < len(capture):
        kind, length = struct.unpack_from("<II", capture, at)
        if kind == _ENHANCED_PACKET:
            size = int.from_bytes(capture[at + 20 : at + 24], "little")
            payloads.append(_udp_payload(capture[at + 28 : at + 28 + size]))
        at += length
    return tuple(payloads)


def _udp_payload(packet: bytes) -> bytes:
    start = _ETHERNET + 4 * (packet[_ETHERNET] & 0x0F)
    length = int.from_bytes(packet[start + 4 : start + 6], "big")
    return packet[start + _UDP : start + length]


def of_session(message_id: int) -> tuple[bytes, ...]:
    """Those datagrams of the session that carry this message."""
    return tuple(d for d in session() if int.from_bytes(d[:2], "little") == message_id)


def single_datagrams() -> tuple[tuple[str, Bitstream, bytes], ...]:
    """Every datagram that was captured on its own: file name, bitstream, bytes."""
    found = []
    for path in sorted(FOLDER.glob("*.bin")):
        match = re.search(r"natnet-(\d+)\.(\d+)_", path.name)
        if match:
            found.append((path.name, Bitstream(int(match[1]), int(match[2])), path.read_bytes()))
    return tuple(found)
