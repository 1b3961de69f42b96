"""Takes out of network captures: which datagrams are NatNet, which end is the server, what came and what went.

A capture does not say who we are. Whatever a server sends counts as come in, whatever is sent to one as gone out, as if
the client had recorded it. Captures that we wrote ourselves say it all, in the names of their interfaces and the
packets' flags.
"""

from __future__ import annotations

import json
import logging
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from retarget.errors import InputError
from retarget.take.metadata import TakeMetadata, from_text_map
from retarget.take.network import Endpoint, UdpExtractor, UdpPacket
from retarget.take.packets import CaptureNotes, is_capture, read_packets
from retarget.take.reader import Take
from retarget.udp.datagram import Datagram
from retarget.udp.natnet.messages import MessageId

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from retarget.take.message import Channel
    from retarget.take.packets import Packet

__all__ = ["INTERFACES", "METADATA_KEY", "is_capture", "read_capture"]

INTERFACES: Final[dict[Channel, str]] = {"command": "natnet-command", "data": "natnet-data"}
"""Names of the interfaces in captures of ours, by channel."""
METADATA_KEY: Final = "retarget.take"
"""Key of the take's metadata in the section's comment, a JSON object."""

_CHANNEL_OF_INTERFACE: Final[dict[str, Channel]] = {name: channel for channel, name in INTERFACES.items()}
_PORTS: Final = (1510, 1511)
_DATA_PORT: Final = 1511
_OUT_FLAG: Final = 2
_MESSAGES: Final = frozenset(MessageId)
_FROM_SERVER: Final = frozenset(
    {
        MessageId.SERVERINFO,
        MessageId.RESPONSE,
        MessageId.MODELDEF,
        MessageId.FRAMEOFDATA,
        MessageId.MESSAGESTRING,
        MessageId.DISCONNECTBYTIMEOUT,
        MessageId.ECHORESPONSE,
        MessageId.UNRECOGNIZED_REQUEST,
    }
)

log = logging.getLogger("retarget.take")


@dataclass(frozen=True, slots=True)
class _Seen:
    """A NatNet datagram of the capture, its role found."""

    time_ns: int
    direction: Literal["in", "out"]
    channel: Channel
    udp: UdpPacket
    is_frame: bool

    @property
    def peer(self) -> Endpoint:
        return self.udp.source if self.direction == "in" else self.udp.destination


def read_capture(path: Path) -> Take:
    """The NatNet datagrams of a pcapng or pcap file; what had to be left out is logged.

    Where a server sent its frames to several clients, only those to the one that got most are kept.
    Raises InputError where there is none.
    """
    notes, extractor = CaptureNotes(), UdpExtractor()
    with path.open("rb") as file:
        seen = list(_natnet(file_packets=read_packets(file, notes), extractor=extractor))
    if not seen:
        raise InputError(
            f"{path}: there is no NatNet datagram in this capture ({extractor.others} packets of other kinds). "
            "Capture with the filter: udp port 1510 or udp port 1511"
        )
    _tell(path, notes, extractor)
    metadata = _metadata(notes)
    kept = _one_client(path, seen)
    if metadata is None:
        kept.sort(key=lambda one: one.time_ns)
        metadata = TakeMetadata(source=path.name, clock_offset_ns=kept[0].time_ns)
    cut = f"{path} ends within a packet or is damaged there; what stands before it was read" if notes.cut else ""
    if cut:
        log.warning("%s", cut)
    return _take(path, metadata, kept, cut)


def _natnet(file_packets: Iterator[Packet], extractor: UdpExtractor) -> Iterator[_Seen]:
    for packet in file_packets:
        if not packet.whole:
            extractor.damaged += 1
            continue
        udp = extractor(packet.link_type, packet.data)
        if udp is None:
            continue
        channel = _CHANNEL_OF_INTERFACE.get(packet.interface)
        message = _message_id(udp)
        if channel is not None:
            way: Literal["in", "out"] = "out" if packet.flags == _OUT_FLAG else "in"
            yield _Seen(packet.time_ns, way, channel, udp, message == MessageId.FRAMEOFDATA)
        elif message is not None:
            yield _with_role(packet.time_ns, udp, message)
        else:
            extractor.others += 1


def _message_id(udp: UdpPacket) -> int | None:
    """The NatNet message, or None: a known number, and either NatNet's port or the right length."""
    number = int.from_bytes(udp.payload[:2], "little")
    if len(udp.payload) < 4 or number not in _MESSAGES:
        return None
    declared = int.from_bytes(udp.payload[2:4], "little")
    usual = udp.source[1] in _PORTS or udp.destination[1] in _PORTS
    return number if usual or declared == len(udp.payload) - 4 else None


def _with_role(time_ns: int, udp: UdpPacket, message: int) -> _Seen:
    is_frame = message == MessageId.FRAMEOFDATA
    is_data = is_frame or _DATA_PORT in (udp.source[1], udp.destination[1])
    way: Literal["in", "out"] = "in" if message in _FROM_SERVER else "out"
    return _Seen(time_ns, way, "data" if is_data else "command", udp, is_frame)


def _one_client(path: Path, seen: list[_Seen]) -> list[_Seen]:
    receivers = Counter((one.udp.source[0], one.udp.destination) for one in seen if one.is_frame)
    kept: dict[str, Endpoint] = {}
    for (server, receiver), _ in receivers.most_common():
        kept.setdefault(server, receiver)
    left_out = sum(n for (server, receiver), n in receivers.items() if kept[server] != receiver)
    if not left_out:
        return seen
    names = ", ".join(f"{address}:{port}" for address, port in kept.values())
    log.warning(
        "%s: the frames went to several clients; those to %s are read, %d others left out", path, names, left_out
    )
    return [one for one in seen if not one.is_frame or one.udp.destination == kept[one.udp.source[0]]]


def _metadata(notes: CaptureNotes) -> TakeMetadata | None:
    """What a capture of ours says of itself; None for any other."""
    try:
        texts = json.loads(notes.comment).get(METADATA_KEY)
    except (ValueError, AttributeError, RecursionError):
        return None
    if not isinstance(texts, dict) or not all(isinstance(value, str) for value in texts.values()):
        return None
    metadata = from_text_map(texts)
    return None if metadata.clock_offset_ns is None else metadata


def _take(path: Path, metadata: TakeMetadata, kept: list[_Seen], cut: str) -> Take:
    offset = metadata.clock_offset_ns or 0
    datagrams = [
        Datagram((one.time_ns - offset) / 1e9, one.direction, one.channel, one.peer, one.udp.payload) for one in kept
    ]
    start = datagrams[0].received_s
    return Take(
        path=path,
        metadata=metadata,
        counts=Counter(datagram.channel for datagram in datagrams),
        start_s=start,
        duration_s=max(datagram.received_s for datagram in datagrams) - start,
        datagrams_from=lambda time_s: iter(_received_from(datagrams, time_s)),
        cut=cut,
    )


def _received_from(datagrams: list[Datagram], time_s: float) -> list[Datagram]:
    return [datagram for datagram in datagrams if datagram.received_s >= time_s]


def _tell(path: Path, notes: CaptureNotes, extractor: UdpExtractor) -> None:
    left_out = {
        "packets of other kinds": extractor.others,
        "packets without a time": notes.without_time,
        "damaged or shortened datagrams": extractor.damaged,
        "datagrams of which a fragment is missing": extractor.incomplete,
    }
    words = ", ".join(f"{count} {what}" for what, count in left_out.items() if count)
    if words:
        log.warning("%s: left out: %s", path, words)
