"""A network in memory with its own clock, between a session and a server's responder; it loses what it is told to."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from retarget.frames import MarkerFrame, MarkerLayout
from retarget.udp.natnet.codec import encode
from retarget.udp.natnet.framedata import Ticks
from retarget.udp.natnet.messages import ConnectionInfo
from retarget.udp.natnet.playback import Playback
from retarget.udp.natnet.reel import MarkerReel
from retarget.udp.natnet.responder import Responder

if TYPE_CHECKING:
    from collections.abc import Callable

    from retarget.udp.natnet.session import NatNetSession
    from retarget.udp.natnet.version import Bitstream

CLOCK_HZ = 10_000_000
CLIENT = ("192.0.2.7", 40_000)
DELAY_S = 0.0002
NAMES = ("brow", "nose", "chin")


def marker_frames(count: int, names: tuple[str, ...] = NAMES, rate_hz: float = 100.0) -> list[MarkerFrame]:
    """Frames whose positions tell their number, metres."""
    layout = MarkerLayout("made", names)
    base = np.arange(3.0 * len(names)).reshape(-1, 3) / 100
    return [MarkerFrame(i, i / rate_hz, i / rate_hz, layout, base + i / 1000) for i in range(count)]


def responder(
    bitstream: Bitstream, names: tuple[str, ...] = NAMES, *, frames: int = 10, group: str | None = None
) -> Responder:
    """A server's command channel."""
    reel = MarkerReel(marker_frames(frames, names))
    info = ConnectionInfo(CLOCK_HZ, 1511, int(group is not None), group or "239.255.42.99")
    return Responder(reel, Playback(frames), bitstream, info, reel.rate_hz)


@dataclass
class Wire:
    """Carries datagrams one way in `DELAY_S`; `loses` is asked for each."""

    session: NatNetSession
    server: Responder | None
    now_s: float = 1000.0
    loses: Callable[[bytes], bool] = lambda _: False
    asked: list[bytes] = field(default_factory=list)
    """Everything that the session sent."""

    def run(self, seconds: float, step_s: float = 0.005) -> None:
        """Let time pass."""
        for _ in range(round(seconds / step_s)):
            for datagram in self.session.due(self.now_s):
                self.session.sent(datagram, self.now_s)
                self.asked.append(datagram)
                self._carry(datagram)
            self.now_s += step_s

    def play(self, number: int, flags: int = 0) -> MarkerFrame | None:
        """Send one frame to the session, exposed now."""
        if self.server is None:
            return None
        client = self.server.clients.get(CLIENT)
        bitstream = client.bitstream if client is not None else self.server.bitstream
        data = replace(self.server.reel.frame(number % 10), number=number, ticks=self._ticks(), params=flags)
        return self.session.receive(encode(data, bitstream), self.now_s + DELAY_S)

    def count(self, message_id: int) -> int:
        """How often the session sent this message."""
        return sum(int.from_bytes(datagram[:2], "little") == message_id for datagram in self.asked)

    def _ticks(self) -> Ticks:
        exposure = int((self.now_s - 0.001) * CLOCK_HZ)
        return Ticks(exposure, exposure, exposure)

    def _carry(self, datagram: bytes) -> None:
        if self.server is None or self.loses(datagram):
            return
        answer = self.server.answer(datagram, CLIENT, self.now_s + DELAY_S)
        if answer is not None and not self.loses(answer):
            self.session.receive(answer, self.now_s + 2 * DELAY_S)
