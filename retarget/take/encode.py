"""Marker clips as a session on the wire: what a NatNet server would have sent, and what its client.

The datagrams are those of a connection to our own server: connect, frame rate, model definitions, frames. Marker
positions are kept to float32. Nothing depends on when or where it runs: a clip always gives the same datagrams.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, Literal

from retarget.take.metadata import TakeMetadata
from retarget.udp.datagram import Datagram
from retarget.udp.natnet.codec import encode
from retarget.udp.natnet.messages import (
    Connect,
    ConnectionInfo,
    ConnectionOptions,
    Request,
    RequestModelDef,
    Response,
    Sender,
    ServerInfo,
)
from retarget.udp.natnet.questions import FRAME_RATE
from retarget.udp.natnet.reel import MarkerReel
from retarget.udp.natnet.url import COMMAND_PORT, DATA_PORT, DEFAULT_BITSTREAM, MULTICAST_GROUP

if TYPE_CHECKING:
    from collections.abc import Iterator

    from retarget.markers.clip import MarkerClip
    from retarget.udp.natnet.messages import Message

_HOST: Final = "127.0.0.1"
_CLOCK_HZ: Final = 10_000_000
_VERSION: Final = (*DEFAULT_BITSTREAM, 0, 0)


def datagrams_of(clip: MarkerClip) -> Iterator[Datagram]:
    """The session; its first frame comes at 0 s.

    Raises InputError where the clip has no frames, or more markers than a NatNet frame carries.
    """
    frames = [replace(frame, number=clip.first_frame + frame.number) for frame in clip]
    reel = MarkerReel(frames, subject=clip.layout.name, rate_hz=clip.rate_hz)
    us = Sender.named("retarget", (0, 1, 0, 0), _VERSION)
    yield _command("out", Connect(us, ConnectionOptions(0, _VERSION)))
    yield _command("in", ServerInfo(us, ConnectionInfo(_CLOCK_HZ, DATA_PORT, 0, MULTICAST_GROUP)))
    yield _command("out", Request.of(FRAME_RATE))
    yield _command("in", Response.of_float32(clip.rate_hz))
    yield _command("out", RequestModelDef())
    yield _command("in", reel.definitions)
    for i, frame in enumerate(frames):
        payload = encode(reel.frame(i), DEFAULT_BITSTREAM)
        yield Datagram(frame.time_s, "in", "data", (_HOST, DATA_PORT), payload)


def metadata_of(clip: MarkerClip) -> TakeMetadata:
    """What a take of `clip` says of itself; a clip knows no date, so that its wall clock starts with the epoch."""
    versions = {"natnet": str(DEFAULT_BITSTREAM)}
    return TakeMetadata(source=clip.source.name, versions=versions, clock_offset_ns=0)


def _command(direction: Literal["in", "out"], message: Message) -> Datagram:
    return Datagram(0.0, direction, "command", (_HOST, COMMAND_PORT), encode(message, DEFAULT_BITSTREAM))
