"""The loop: source -> session -> sinks."""

from __future__ import annotations

import logging
import time
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from retarget.latency import LatencyHistogram
from retarget.sinks import open_frame_outlet, open_outlet, takes_frames

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from retarget.frames import MarkerFrame, Pose
    from retarget.outlets import Outlet, Sink
    from retarget.session import Session
    from retarget.sinks import SinkSettings
    from retarget.sources import Source

log = logging.getLogger("retarget.pipeline")


@dataclass(frozen=True, slots=True)
class SinkReport:
    """What became of one sink."""

    written: int
    dropped: int
    error: str | None


@dataclass(frozen=True, slots=True)
class RunReport:
    """What a run did."""

    source: dict[str, int]
    """Frames received, lost and so on, as the source counts them."""
    poses: int
    seconds: float
    latency_p50_ms: float | None
    """From the arrival of a datagram to its pose; None for a file, and without poses."""
    latency_p99_ms: float | None
    sinks: dict[str, SinkReport]

    def as_dict(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self)

    @property
    def errors(self) -> list[str]:
        """What sinks said that came to an early end."""
        return [sink.error for sink in self.sinks.values() if sink.error]


class Run:
    """One performance from a source through a session into any number of sinks.

    Use it as a context manager, which opens the source and the sinks, and closes them all:
    sinks first take what still waits for them. `stop` ends it early from anywhere.
    """

    def __init__(
        self,
        source: Source,
        session: Session | None,
        targets: Sequence[str],
        settings: Callable[[Source], SinkSettings],
        window: Sink | None = None,
    ) -> None:
        """Without a `session` nothing is solved, and only targets that take frames are of use.

        `settings` is asked once the source is open and knows its rate; `window` is fed directly, since it never
        waits.
        """
        self._source = source
        self._session = session
        self._targets = targets
        self._settings = settings
        self._window = window
        self._latency = LatencyHistogram()
        self._poses_to: list[Outlet[Pose]] = []
        self._frames_to: list[Outlet[MarkerFrame]] = []
        self._stack = ExitStack()
        self._started_s = time.monotonic()
        self.poses = 0
        """Poses solved so far."""

    def __enter__(self) -> Run:
        with ExitStack() as stack:
            stack.enter_context(self._source)
            self._make_outlets()
            for outlet in self._outlets:
                outlet.start()
                stack.callback(outlet.finish)
            if not self._source.live:  # a live stream is running by now, and its frames do not wait for sinks
                for outlet in self._outlets:
                    outlet.wait_open()
            self._stack = stack.pop_all()
        self._started_s = time.monotonic()
        return self

    def _make_outlets(self) -> None:
        settings = self._settings(self._source)
        live = self._source.live or self._window is not None
        for target in self._targets:
            if takes_frames(target):
                self._frames_to.append(open_frame_outlet(target, live=live))
            else:
                self._poses_to.append(open_outlet(target, settings, live=live))

    @property
    def _outlets(self) -> list[Outlet[Pose] | Outlet[MarkerFrame]]:
        return [*self._poses_to, *self._frames_to]

    def __exit__(self, *failure: object) -> None:
        self._stack.close()

    def stop(self) -> None:
        """End the stream; what waits is still written."""
        self._source.stop()

    def abandon(self) -> None:
        """End the stream and forget what waits; files are closed with what they hold."""
        self._source.stop()
        for outlet in self._outlets:
            outlet.abandon()

    @property
    def unwritten(self) -> int:
        """Poses that wait for the slowest sink."""
        return max((outlet.waiting for outlet in self._outlets), default=0)

    def solve_all(self, on_frame: Callable[[], None] = lambda: None) -> None:
        """Solve the stream to its end and hand the poses out; `on_frame` is called after every frame."""
        for frame in self._source:
            for frames in self._frames_to:
                frames.put(frame)
            if self._session is not None:
                self._hand_out(self._session(frame))
            on_frame()
            for outlet in self._outlets:
                outlet.check_opening()
            if self._outlets and all(outlet.error for outlet in self._outlets) and self._window is None:
                break
        if self._session is not None:
            self._hand_out(self._session.finish())

    def report(self) -> RunReport:
        """What was done so far; complete after the end."""
        timed = self._source.live and self.poses > 0
        return RunReport(
            source=self._source.counts(),
            poses=self.poses,
            seconds=time.monotonic() - self._started_s,
            latency_p50_ms=self._latency.percentile_ms(50) if timed else None,
            latency_p99_ms=self._latency.percentile_ms(99) if timed else None,
            sinks={o.name: SinkReport(o.written, o.dropped, str(o.error) if o.error else None) for o in self._outlets},
        )

    def _hand_out(self, poses: Sequence[Pose]) -> None:
        for pose in poses:
            if len(poses) == 1:  # poses that waited for the neutral tell nothing of the latency
                self._latency.add(time.monotonic() - pose.received_s)
            for outlet in self._poses_to:
                outlet.put(pose)
            if self._window is not None:
                self._window(pose)
            self.poses += 1
