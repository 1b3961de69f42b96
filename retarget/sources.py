"""Where marker frames come from, by the ending of a file name or the scheme of an address.

Other packages add sources through the entry-point group ``retarget.sources``: the entry's name is the scheme or ending,
its object a function from the text that the user gave to a `Source`.
"""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from dataclasses import asdict
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Self

from retarget.camera.pictures import FILM_ENDINGS
from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from types import TracebackType

    from retarget.frames import MarkerFrame
    from retarget.markers.clip import MarkerClip
    from retarget.take.reader import Take
    from retarget.udp.datagram import Datagram
    from retarget.udp.natnet.source import NatNetSource


class Source(Protocol):
    """Marker frames in the capture volume, under the names that the source has for them; a context manager."""

    @property
    def live(self) -> bool:
        """True where frames come when they come, and are lost if nobody takes them."""

    @property
    def rate_hz(self) -> float | None:
        """Frames a second, once the source is open; None if it does not tell."""

    @property
    def frame_count(self) -> int | None:
        """How many frames there will be; None if nobody knows."""

    def counts(self) -> dict[str, int]:
        """What happened on the way so far, by name: frames lost, datagrams refused and the like."""

    def stop(self) -> None:
        """End the iteration soon; may be called from another thread or from a signal's function."""

    def __enter__(self) -> Self:
        """Open it; RetargetError where that fails."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""

    def __iter__(self) -> Iterator[MarkerFrame]:
        """The frames, as they come."""


class Recorded(ABC):
    """What lies on the disk: frames as fast as they are taken."""

    live = False
    frame_count: int | None = None

    def __init__(self) -> None:
        self._stopped = False

    @property
    @abstractmethod
    def rate_hz(self) -> float | None:
        """The recording's own rate [Hz]."""

    @abstractmethod
    def counts(self) -> dict[str, int]:
        """What happened to the frames when they were recorded, and how many have been given."""

    @abstractmethod
    def _frames(self) -> Iterator[MarkerFrame]:
        """All frames in order."""

    def stop(self) -> None:
        """No frame after the current one."""
        self._stopped = True

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def __iter__(self) -> Iterator[MarkerFrame]:
        for frame in self._frames():
            if self._stopped:
                return
            yield frame


class ClipSource(Recorded):
    """The markers of a file, in memory."""

    def __init__(self, clip: MarkerClip) -> None:
        super().__init__()
        self._clip = clip
        self._given = 0
        self.frame_count = len(clip)

    @property
    def rate_hz(self) -> float | None:
        """The take's own rate [Hz]."""
        return self._clip.rate_hz

    def counts(self) -> dict[str, int]:
        """A file loses nothing."""
        return {"received": self._given}

    def _frames(self) -> Iterator[MarkerFrame]:
        for frame in self._clip:
            self._given += 1
            yield frame


class TakeSource(Recorded):
    """A recorded session, decoded again as it is read."""

    def __init__(self, take: Take) -> None:
        from retarget.take.decode import TakeFrames

        super().__init__()
        self._take = TakeFrames(take)

    @property
    def rate_hz(self) -> float | None:
        """As the server told, or as its frames came [Hz]."""
        return self._take.rate_hz

    def counts(self) -> dict[str, int]:
        """What became of the datagrams on their way to the recorder."""
        framing = self._take.session.framing
        return {
            "received": framing.delivered,
            "lost": framing.lost,
            "doubled": framing.doubled,
            "late": framing.late,
            "malformed": self._take.session.malformed,
        }

    def _frames(self) -> Iterator[MarkerFrame]:
        return iter(self._take)


class NatNetMarkers:
    """A NatNet server; frames come when they come."""

    live = True
    frame_count = None

    def __init__(self, source: NatNetSource) -> None:
        self._source = source

    @property
    def rate_hz(self) -> float | None:
        """As the server told [Hz]."""
        return self._source.rate_hz

    def counts(self) -> dict[str, int]:
        """What became of the datagrams."""
        return asdict(self._source.stats)

    def stop(self) -> None:
        """End the iteration soon."""
        self._source.stop()

    def __enter__(self) -> Self:
        self._source.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._source.close()

    def __iter__(self) -> Iterator[MarkerFrame]:
        return iter(self._source)


class Paced:
    """A take in memory at its own speed, for somebody who watches."""

    live = False

    def __init__(self, source: Source) -> None:
        self._source = source
        self._stopped = threading.Event()

    @property
    def rate_hz(self) -> float | None:
        """That of the take [Hz]."""
        return self._source.rate_hz

    @property
    def frame_count(self) -> int | None:
        """That of the take."""
        return self._source.frame_count

    def counts(self) -> dict[str, int]:
        """Those of the take."""
        return self._source.counts()

    def stop(self) -> None:
        """No frame after the current one."""
        self._stopped.set()
        self._source.stop()

    def __enter__(self) -> Self:
        self._source.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._source.__exit__(kind, error, trace)

    def __iter__(self) -> Iterator[MarkerFrame]:
        start_s = time.monotonic()
        for frame in self._source:
            if self._stopped.wait(max(0.0, start_s + frame.time_s - time.monotonic())):
                return
            yield frame


def open_source(where: str, tap: Callable[[Datagram], None] | None = None, detector: str | None = None) -> Source:
    """The source for a file or an address, not yet opened; `tap` is given every datagram of a live one.

    `detector` finds the landmarks where the source is pictures. InputError where no source takes `where`, and for a
    `tap` on what cannot be recorded.
    """
    name = _kind(where)
    if name in RECORDABLE:
        return RECORDABLE[name](where, tap)
    if tap is not None:
        raise InputError(f"{where} cannot be recorded; only a stream from {', '.join(_addresses(RECORDABLE))} can.")
    if name in PICTURES:
        from retarget.camera.source import CameraSource

        return CameraSource(where, detector or "mediapipe")
    if name in OTHERS:
        return OTHERS[name](where)
    for entry in entry_points(group="retarget.sources", name=name):
        source: Source = entry.load()(where)
        return source
    if "://" not in where and not Path(where).exists():
        raise InputError(f"There is no file {where}.")
    raise InputError(f"Markers cannot be read from {where!r}; a source is one of {', '.join(known_sources())}.")


def known_sources() -> list[str]:
    """What a source can be, for people to read."""
    others = sorted(entry.name for entry in entry_points(group="retarget.sources"))
    endings = [f"*{ending}" for ending in (*OTHERS, *FILM_ENDINGS) if ending.startswith(".")]
    return [*_addresses(RECORDABLE), "udp://:PORT", "camera:0", "a folder of pictures", *endings, *others]


def are_landmarks(where: str) -> bool:
    """Whether the points of this source are found in pictures, which is noisier than markers are."""
    return _kind(where) in {"udp", *PICTURES}


def _kind(where: str) -> str:
    """A scheme, ``camera``, ``folder``, or the ending of a file's name."""
    if "://" in where:
        return where.split("://", 1)[0]
    if where.startswith("camera:"):
        return "camera"
    return "folder" if Path(where).is_dir() else Path(where).suffix.lower()


def _addresses(schemes: Iterable[str]) -> list[str]:
    return [f"{scheme}://HOST" for scheme in schemes]


def _clip(where: str) -> Source:
    from retarget.take.convert import read_clip

    return ClipSource(read_clip(Path(where)))


def _take(where: str) -> Source:
    from retarget.take.reader import read_take

    return TakeSource(read_take(Path(where)))


def _natnet(where: str, tap: Callable[[Datagram], None] | None) -> Source:
    from retarget.udp.natnet.source import NatNetSource

    return NatNetMarkers(NatNetSource(where, tap=tap))


def _landmarks(where: str) -> Source:
    from retarget.udp.landmark_source import LandmarkSource

    return LandmarkSource(where)


PICTURES = ("camera", "folder", *FILM_ENDINGS)
RECORDABLE: dict[str, Callable[[str, Callable[[Datagram], None] | None], Source]] = {"natnet": _natnet}
OTHERS: dict[str, Callable[[str], Source]] = {
    "udp": _landmarks,
    **dict.fromkeys((".mcap", ".pcapng", ".pcap"), _take),
    **dict.fromkeys((".c3d", ".trc", ".csv"), _clip),
}
