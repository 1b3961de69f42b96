"""Where poses go, by the ending of a file name or the scheme of an address.

Other packages add sinks through the entry-point group ``retarget.sinks``: the entry's name is the scheme or ending
(``vmc``, ``.bvh``), its object a function like those here.
"""

from __future__ import annotations

import os
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING

from retarget.errors import InputError
from retarget.outlets import Backlog, Outlet

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from retarget.frames import MarkerFrame, Pose
    from retarget.outlets import FrameSink, Sink
    from retarget.rig.display.view import View
    from retarget.rig.model import Rig
    from retarget.rig.skinning import Skin, SkinningMethod

    Opener = Callable[[str, "SinkSettings"], AbstractContextManager[Sink]]


WINDOW = "window"
_FILE_BACKLOG = 256
_LIVE_BACKLOG = 20_000  # poses; 80 s at 240 Hz and about 80 MB, before a sink that lags loses its oldest


@dataclass(frozen=True, slots=True)
class SinkSettings:
    """What a sink has to know of the run; it travels to other processes, so it holds no open thing."""

    rig: str
    """Name or path, as for `load_rig`."""
    view: View
    skinning: SkinningMethod = "linear"
    picture_hz: float = 60.0
    """Pictures a second of films and picture folders."""


def open_outlet(target: str, settings: SinkSettings, *, live: bool) -> Outlet[Pose]:
    """The outlet for `target`, not yet started; InputError where no sink takes such a target."""
    return Outlet(target, partial(_opener(target), target, settings), *_backlog(live=live))


def takes_frames(target: str) -> bool:
    """Whether marker frames go to this target, as the source gives them, and not poses."""
    return target.split("://", 1)[0] in FRAME_SCHEMES and "://" in target


def open_frame_outlet(target: str, *, live: bool) -> Outlet[MarkerFrame]:
    """The outlet for a target that `takes_frames`, not yet started."""
    return Outlet(target, partial(FRAME_SCHEMES[target.split("://", 1)[0]], target), *_backlog(live=live))


def _backlog(*, live: bool) -> tuple[Backlog, int]:
    return (Backlog.DROP_OLDEST, _LIVE_BACKLOG) if live else (Backlog.WAIT, _FILE_BACKLOG)


def known_targets() -> list[str]:
    """What `--to` takes, for people to read."""
    others = sorted(entry.name for entry in entry_points(group="retarget.sinks"))
    streams = [f"{scheme}://HOST:PORT" for scheme in FRAME_SCHEMES]
    return [WINDOW, *(f"*{ending}" for ending in ENDINGS), "FOLDER/ (PNG pictures)", *streams, *others]


def _opener(target: str) -> Opener:
    if target.endswith(("/", os.sep)) or Path(target).is_dir():
        return _stills
    name = target.split("://", 1)[0] if "://" in target else Path(target).suffix.lower()
    if name in ENDINGS:
        return ENDINGS[name]
    for entry in entry_points(group="retarget.sinks", name=name):
        opener: Opener = entry.load()
        return opener
    raise InputError(f"Nothing can be written to {target!r}; --to takes {', '.join(known_targets())}.")


@contextmanager
def _table(target: str, settings: SinkSettings) -> Iterator[Sink]:
    from retarget.export.csv import PosesCsv
    from retarget.rig.load import load_rig

    rig = load_rig(settings.rig)
    with PosesCsv(Path(target), rig.joints.names, rig.shape_names) as sink:
        yield sink


def _film(target: str, settings: SinkSettings) -> AbstractContextManager[Sink]:
    from retarget.child import ChildSink

    return ChildSink(draw_film, target, settings)


def _stills(target: str, settings: SinkSettings) -> AbstractContextManager[Sink]:
    from retarget.child import ChildSink

    return ChildSink(draw_stills, target, settings)


def _landmarks(target: str) -> AbstractContextManager[FrameSink]:
    from retarget.udp.landmark_sink import LandmarkSink

    return LandmarkSink(target)


@contextmanager
def _openvhead(target: str) -> Iterator[FrameSink]:
    from retarget.camera.openvhead_feed import OpenVHeadFeed
    from retarget.udp.openvhead_message import OpenVHeadMessage
    from retarget.udp.openvhead_tcp import OpenVHeadClient

    feed = OpenVHeadFeed()
    with OpenVHeadClient(target) as client:

        def sink(frame: MarkerFrame) -> None:
            values = feed(frame)
            if values is not None:
                client(OpenVHeadMessage(*values.fields()))

        yield sink


FRAME_SCHEMES: dict[str, Callable[[str], AbstractContextManager[FrameSink]]] = {"udp": _landmarks, "tcp": _openvhead}
ENDINGS: dict[str, Opener] = {".csv": _table, ".mp4": _film}


@contextmanager
def draw_film(target: str, settings: SinkSettings) -> Iterator[Sink]:
    """A film at an even rate; runs in a process of its own."""
    from retarget.rig.display.video import Mp4Sink
    from retarget.sampling import PictureClock

    rig, skin = _rig_and_skin(settings)
    clock = PictureClock(settings.picture_hz)
    with Mp4Sink(Path(target), rig, settings.picture_hz, settings.view, skin) as film:

        def sink(pose: Pose) -> None:
            for _ in range(clock.due(pose.time_s)):
                film(pose)

        yield sink


@contextmanager
def draw_stills(target: str, settings: SinkSettings) -> Iterator[Sink]:
    """A folder of PNG pictures named by frame number; runs in a process of its own."""
    from retarget.rig.display.frames import FramesSink
    from retarget.sampling import PictureClock

    rig, skin = _rig_and_skin(settings)
    clock = PictureClock(settings.picture_hz)
    with FramesSink(Path(target), rig, settings.view, skin) as stills:

        def sink(pose: Pose) -> None:
            if clock.due(pose.time_s):
                stills(pose)

        yield sink


def _rig_and_skin(settings: SinkSettings) -> tuple[Rig, Skin]:
    from retarget.rig.load import load_rig
    from retarget.rig.skinning import Skin

    rig = load_rig(settings.rig)
    return rig, Skin(rig, settings.skinning)
