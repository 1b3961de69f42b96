"""Plays a reel: the thread that sends each frame when it is due, to all who listen, written once per bitstream."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING

from retarget.udp.natnet.codec import encode
from retarget.udp.natnet.framedata import Ticks
from retarget.udp.natnet.messages import Disconnect
from retarget.udp.natnet.pacing import Schedule

if TYPE_CHECKING:
    from collections.abc import Callable

    from retarget.udp.natnet.clients import Clients
    from retarget.udp.natnet.framedata import FrameOfData
    from retarget.udp.natnet.pacing import Pace
    from retarget.udp.natnet.playback import Playback
    from retarget.udp.natnet.reel import Reel
    from retarget.udp.natnet.version import Bitstream
    from retarget.udp.sockets import Address

    Send = Callable[[bytes, Address], bool]

_LONGEST_WAIT_S = 0.5
_GRACE_S = 2.0
_SETTLE_S = 0.1
_FAREWELL_S = 0.2
_FAREWELLS, _FAREWELL_STEP_S = 3, 0.02


class Begin(Enum):
    """When the first frame is played."""

    AT_ONCE = "at once"
    WITH_FIRST_CLIENT = "with the first client"
    """Once somebody has the model definitions, so that he misses no frame; or was connected 2 s without asking."""


@dataclass(frozen=True, slots=True)
class Outlet:
    """Where a player's datagrams go."""

    send_frame: Send
    send_message: Send
    clock_hz: int
    """Ticks per second of the server's clock, which is the local monotonic one."""
    group: tuple[Address, Bitstream] | None = None
    """Group and bitstream of multicast; None sends to each client."""


class Player:
    """Runs until `stop`. `changed` guards the clients and the playback, and is notified when either changes."""

    def __init__(
        self,
        reel: Reel,
        playback: Playback,
        pace: Pace,
        begin: Begin,
        clients: Clients,
        changed: threading.Condition,
        outlet: Outlet,
    ) -> None:
        self._reel, self._playback, self._pace, self._begin = reel, playback, pace, begin
        self._clients, self._changed, self._outlet = clients, changed, outlet
        self._times_s = reel.times_s
        self._stopping = False
        self._finished = threading.Event()
        self.sent = self.unsent = 0
        """Frames played, and datagrams that could not leave."""
        self._thread = threading.Thread(target=self._run, name="natnet player", daemon=True)

    def start(self) -> None:
        """Begin to play."""
        self._thread.start()

    def stop(self) -> None:
        """End now, and say so to the clients."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        self._thread.join()

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait until the last frame was played and the clients were told; whether that is so."""
        return self._finished.wait(timeout_s)

    def _run(self) -> None:
        try:
            self._wait_for_clients()
            self._play()
            self._take_leave()
        finally:
            self._finished.set()

    def _wait_for_clients(self) -> None:
        with self._changed:
            while not self._stopping and not self._may_begin():
                self._changed.wait(_SETTLE_S)
            if self._begin is Begin.WITH_FIRST_CLIENT:  # the definitions are on their way
                self._changed.wait_for(lambda: self._stopping, _SETTLE_S)

    def _may_begin(self) -> bool:
        return self._begin is Begin.AT_ONCE or self._clients.anyone_ready(time.monotonic(), _GRACE_S)

    def _play(self) -> None:
        schedule = Schedule(time.monotonic())
        while (due := self._next_frame(schedule)) is not None:
            index, interval_s, listeners = due
            self._send_frame(self._reel.frame(index), schedule.due_s, listeners)
            schedule.advance(interval_s, time.monotonic())

    def _next_frame(self, schedule: Schedule) -> tuple[int, float, dict[Bitstream, list[Address]]] | None:
        """Wait until a frame is due: its index, the time to the one after it, and who gets it; None at the end."""
        playback = self._playback
        with self._changed:
            while not self._stopping and not playback.finished:
                now_s = time.monotonic()
                if not playback.playing:
                    self._changed.wait(_LONGEST_WAIT_S)
                    schedule.restart(time.monotonic())
                elif now_s < schedule.due_s:
                    self._changed.wait(min(_LONGEST_WAIT_S, schedule.due_s - now_s))
                else:
                    return self._take_frame()
        return None

    def _take_frame(self) -> tuple[int, float, dict[Bitstream, list[Address]]]:
        playback, index = self._playback, self._playback.index
        following = playback.following
        interval_s = 0.0
        if following is not None:
            interval_s = self._pace.interval_s(self._times_s, self._reel.rate_hz, index, following) / playback.speed
        playback.advance()
        return index, interval_s, self._listeners()

    def _listeners(self) -> dict[Bitstream, list[Address]]:
        if self._outlet.group is not None:
            address, bitstream = self._outlet.group
            return {bitstream: [address]}
        return self._clients.by_bitstream()

    def _send_frame(self, frame: FrameOfData, due_s: float, listeners: dict[Bitstream, list[Address]]) -> None:
        exposure = int(due_s * self._outlet.clock_hz)
        ticks = Ticks(exposure, exposure, int(time.monotonic() * self._outlet.clock_hz))
        stamped = replace(frame, ticks=ticks, timestamp_s=self._real_time_s(frame.timestamp_s))
        for bitstream, addresses in listeners.items():
            payload = encode(stamped, bitstream)
            for address in addresses:
                self.unsent += not self._outlet.send_frame(payload, address)
        self.sent += 1

    def _real_time_s(self, take_s: float | None) -> float | None:
        """Time stamps run as fast as the clock on the wall, or clients would think that frames come late."""
        return None if take_s is None else take_s / self._playback.speed

    def _take_leave(self) -> None:
        """Tell the end, several times as datagrams get lost, and after the last frame arrived."""
        with self._changed:
            self._changed.wait_for(lambda: self._stopping, _FAREWELL_S)
            listeners = set(self._clients.addresses())
        farewell = encode(Disconnect())
        for _ in range(_FAREWELLS):
            for address in listeners:
                self._outlet.send_message(farewell, address)
            if self._outlet.group is not None:
                self._outlet.send_frame(farewell, self._outlet.group[0])
            time.sleep(_FAREWELL_STEP_S)
