"""What a take or a clip holds: channels, frames, jitter, what was lost, and how well each marker was seen.

Times in seconds, intervals in milliseconds and distances in millimetres where the name says so. A gap is a run of
frames in which a marker was not seen, between others or at an end; frames that never came are counted apart.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from retarget.take.decode import TakeFrames
from retarget.take.visibility import Visibility

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from retarget.markers.clip import MarkerClip
    from retarget.take.reader import Take
    from retarget.take.visibility import MarkerReport
    from retarget.udp.natnet.session import NatNetSession

    Array = NDArray[np.float64]

_FOR_THE_PLOT: Final = ("frame_times_s", "frame_numbers", "seen")


@dataclass(frozen=True, slots=True)
class Spread:
    """How intervals are distributed [ms]."""

    p1_ms: float
    p50_ms: float
    p99_ms: float
    max_ms: float
    std_ms: float


@dataclass(frozen=True, slots=True)
class ChannelReport:
    """One channel of a take in one direction."""

    channel: str
    direction: str
    datagrams: int
    octets: int
    rate_hz: float
    """Datagrams a second between the first and the last; 0 for one alone."""
    interval: Spread | None
    """Between one datagram and the next; None for one alone."""


@dataclass(frozen=True, slots=True)
class FramesReport:
    """The frames of marker data."""

    received: int
    lost: int
    """Numbers that are missing in between."""
    doubled: int
    late: int
    """Came after one with a higher number."""
    malformed: int
    """Datagrams that could not be read."""
    with_unlabelled: int
    """Frames with points that have no name."""
    first_number: int
    last_number: int


@dataclass(frozen=True, slots=True, eq=False)
class Inspection:
    """Everything that `retarget inspect` shows; `as_dict` is what a script reads."""

    path: Path
    facts: dict[str, str]
    """What the file says of itself: source, server, bitstream, layout ..."""
    duration_s: float
    rate_hz: float | None
    """Frames a second as the sender says, else as its times say; None where neither tells."""
    channels: tuple[ChannelReport, ...]
    """Empty for a marker file."""
    frames: FramesReport
    markers: tuple[MarkerReport, ...]
    notes: tuple[str, ...]
    frame_times_s: Array
    """(N,) reception of each frame from the first datagram on, or a marker file's own times; for the plot."""
    frame_numbers: NDArray[np.int64]
    """(N,) the sender's numbers; for the plot."""
    seen: NDArray[np.bool_]
    """(N, M) whether each marker was seen; for the plot."""

    def as_dict(self) -> dict[str, Any]:
        """Numbers, texts, lists and dictionaries only; no value for every frame."""
        plain = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _FOR_THE_PLOT}
        plain["path"] = str(self.path)
        for name in ("channels", "markers"):
            plain[name] = [asdict(part) for part in plain[name]]
        return {**plain, "frames": asdict(self.frames), "notes": list(self.notes)}


def inspect_take(take: Take) -> Inspection:
    """Look through a take. Raises InputError where it holds no frame that can be read."""
    channels = _channels(take)
    source, visibility = TakeFrames(take), Visibility()
    for frame in source:
        visibility.add(frame)
    session, times = source.session, np.array(visibility.received_s)
    return Inspection(
        path=take.path,
        facts=_facts(take, session),
        duration_s=take.duration_s,
        rate_hz=source.rate_hz,
        channels=channels,
        frames=_frames(visibility, session),
        markers=visibility.markers(times),
        notes=(take.cut,) if take.cut else (),
        frame_times_s=times - take.start_s,
        frame_numbers=np.array(visibility.numbers),
        seen=visibility.seen(),
    )


def inspect_clip(clip: MarkerClip) -> Inspection:
    """Look through the markers of a file."""
    visibility = Visibility()
    for frame in clip:
        visibility.add(frame)
    first, times = clip.first_frame, np.arange(len(clip)) / clip.rate_hz
    return Inspection(
        path=clip.source,
        facts={},
        duration_s=clip.duration_s,
        rate_hz=clip.rate_hz,
        channels=(),
        frames=FramesReport(len(clip), 0, 0, 0, 0, 0, first, first + len(clip) - 1),
        markers=visibility.markers(times),
        notes=clip.notes,
        frame_times_s=times,
        frame_numbers=np.array(visibility.numbers),
        seen=visibility.seen(),
    )


def intervals_ms(times_s: Array) -> Array:
    """(N - 1,) between one time and the next [ms]."""
    return np.diff(times_s) * 1e3


def _channels(take: Take) -> tuple[ChannelReport, ...]:
    times: dict[tuple[str, str], list[float]] = defaultdict(list)
    octets: dict[tuple[str, str], int] = defaultdict(int)
    for datagram in take:
        key = (datagram.channel, datagram.direction)
        times[key].append(datagram.received_s)
        octets[key] += len(datagram.payload)
    return tuple(_channel(*key, np.array(times[key]), octets[key]) for key in sorted(times))


def _channel(channel: str, direction: str, times_s: Array, octets: int) -> ChannelReport:
    steps, span = intervals_ms(times_s), float(np.ptp(times_s))
    rate = (len(times_s) - 1) / span if span > 0 else 0.0
    return ChannelReport(channel, direction, len(times_s), octets, rate, _spread(steps) if len(steps) else None)


def _spread(steps_ms: Array) -> Spread:
    p1, p50, p99 = np.percentile(steps_ms, [1, 50, 99]).tolist()
    return Spread(p1, p50, p99, float(steps_ms.max()), float(steps_ms.std()))


def _frames(visibility: Visibility, session: NatNetSession) -> FramesReport:
    framing = session.framing
    return FramesReport(
        received=framing.delivered,
        lost=framing.lost,
        doubled=framing.doubled,
        late=framing.late,
        malformed=session.malformed,
        with_unlabelled=visibility.with_unlabelled,
        first_number=visibility.numbers[0],
        last_number=visibility.numbers[-1],
    )


def _facts(take: Take, session: NatNetSession) -> dict[str, str]:
    metadata = take.metadata
    facts = {key: getattr(metadata, key) for key in ("source", "layout", "rig", "performer")}
    facts |= {f"{name} version": text for name, text in metadata.versions.items()}
    if session.server is not None:
        facts["server"] = session.server.sender.name
        facts["server version"] = ".".join(map(str, session.server.sender.app_version))
    facts["bitstream"] = str(session.bitstream or "")
    return {key: text for key, text in facts.items() if text}
