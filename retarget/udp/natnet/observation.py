"""What an examined server was seen to send: counts, and which markers. No judgement, no socket."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import ProtocolError
from retarget.udp.natnet.codec import decode
from retarget.udp.natnet.framedata import FrameOfData
from retarget.udp.natnet.messages import Disconnect, MessageId, ServerInfo
from retarget.udp.natnet.models import ModelDef

if TYPE_CHECKING:
    from collections.abc import Sequence

    from retarget.frames import MarkerFrame
    from retarget.udp.natnet.clock import EchoClock
    from retarget.udp.natnet.version import Bitstream
    from retarget.udp.receiver import Arrival

_MODELDEF = int(MessageId.MODELDEF).to_bytes(2, "little")
_MOST_LATENCIES = 10_000


class Observation:
    """Counts since the first datagram. Local monotonic times [s]."""

    def __init__(self) -> None:
        self.server: ServerInfo | None = None
        self.described = False
        """Whether model definitions came."""
        self.unreadable_definitions = 0
        self.frames = 0
        """Frames that could be read."""
        self.unreadable_frames = 0
        self.ended = False
        """Whether the server took its leave."""
        self.first_s = self.last_s = 0.0
        self.labelled = 0
        """Most labelled markers in one frame, seen or not; those of no asset do not count."""
        self.loose = 0
        """Most points without a name in one frame."""
        self.latencies_s: deque[float] = deque(maxlen=_MOST_LATENCIES)
        """From exposure to arrival, for frames that tell it on a clock that is read; unbounded in size and sign."""
        self._seen: set[str] = set()

    @property
    def rate_hz(self) -> float:
        """Frames per second as they came; 0 for fewer than two."""
        return (self.frames - 1) / (self.last_s - self.first_s) if self.last_s > self.first_s else 0.0

    def unseen(self, names: Sequence[str]) -> list[str]:
        """Those of the markers that had no position in any frame."""
        return [name for name in names if name not in self._seen]

    def take(
        self, arrival: Arrival, frame: MarkerFrame | None, bitstream: Bitstream | None, clock: EchoClock | None
    ) -> None:
        """Note a datagram and the frame that was made of it, read as `bitstream`."""
        try:
            message = decode(arrival.payload, bitstream)
        except ProtocolError:
            self.unreadable_frames += arrival.is_frame
            self.unreadable_definitions += arrival.payload.startswith(_MODELDEF)
            return
        if isinstance(message, ServerInfo):
            self.server = message
        elif isinstance(message, ModelDef):
            self.described = True
        elif isinstance(message, Disconnect):
            self.ended = True
        elif isinstance(message, FrameOfData):
            self._take_frame(message, arrival.received_s, clock)
        if frame is not None:
            self._take_markers(frame)

    def _take_frame(self, data: FrameOfData, received_s: float, clock: EchoClock | None) -> None:
        self.first_s = received_s if self.frames == 0 else self.first_s
        self.last_s = received_s
        self.frames += 1
        nameless = int(data.labelled.unlabelled.sum())
        self.labelled = max(self.labelled, len(data.labelled) - nameless)
        self.loose = max(self.loose, nameless, len(data.other_markers))  # some servers send them in both ways
        if data.ticks is not None and data.ticks.mid_exposure and clock is not None and clock.synchronised:
            self.latencies_s.append(received_s - clock.local_s(data.ticks.mid_exposure))

    def _take_markers(self, frame: MarkerFrame) -> None:
        names = frame.layout.names
        if len(self._seen) < len(names):
            seen = np.isfinite(frame.positions).all(axis=1)
            self._seen.update(names[i] for i in np.flatnonzero(seen).tolist())
