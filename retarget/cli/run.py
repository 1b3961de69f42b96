"""`retarget run`."""

from __future__ import annotations

import json
import sys
import threading
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget.cli.ending import stopped_after, stopped_by_signals
from retarget.cli.options import Colour, Size, read_config
from retarget.errors import RetargetError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from retarget.pipeline import Run, RunReport
    from retarget.rig.display.view import View
    from retarget.rig.display.window import Window
    from retarget.rig.pose_smoother import Smoothing
    from retarget.session import Session
    from retarget.sinks import SinkSettings
    from retarget.sources import Source
    from retarget.take.recorder import TakeRecorder

SINKS_HELP = "window, out.mp4, frames/, poses.csv, udp://HOST:PORT ...; may be given several times.  [window]"


@click.command()
@click.argument("source")
@click.option("--to", multiple=True, metavar="SINK", help=SINKS_HELP)
@click.option("--rig", default="human", show_default=True, help="Name of a rig, or the path of a rig.toml.")
@click.option("--performer", type=click.Path(), help="A calibration; without it the first still moment is the neutral.")
@click.option("--layout", help="Name of a layout, or the path of its TOML file.  [the one whose names fit best]")
@click.option("--detector", help="Of landmarks in pictures: mediapipe, mediapipe468, mediapipe68, lbf:MODEL.yaml")
@click.option("--record", type=click.Path(), metavar="TAKE", help="Also record a live source, to a new .mcap file.")
@click.option("--seconds", type=click.FloatRange(min=0, min_open=True), help="Stop after so long.")
@click.option("--drive", type=click.Choice(["joints", "shapes", "both"]), default="joints", show_default=True)
@click.option("--smooth", type=click.Choice(["none", "one-euro", "pd"]), help="[none for joints by markers]")
@click.option(
    "--jaw", type=click.Choice(["signed", "cosine"]), help="How the jaw's angle is read.  [as the performer's]"
)
@click.option("--skinning", type=click.Choice(["linear", "dual-quaternion"]), default="linear", show_default=True)
@click.option("--size", type=Size(), default="640x480", show_default=True)
@click.option("--background", type=Colour(), default="0,255,0", show_default=True, help="R,G,B or #rrggbb.")
@click.option("--framing", type=click.Choice(["face", "head", "bust"]), default="head", show_default=True)
@click.option("--turn", type=float, default=0.0, metavar="DEGREES", help="Walk the camera to the character's left.")
@click.option("--antialias", type=click.IntRange(1, 4), help="Samples a pixel, squared.  [2 for a file, 1 live]")
@click.option("--fps", type=click.FloatRange(0, 240, min_open=True), help="Pictures a second.  [the source's, to 60]")
@click.option("--config", is_eager=True, expose_value=False, callback=read_config, help="A TOML file of options.")
@click.option("--json", "as_json", is_flag=True, help="Report for a script.")
def command(source: str, to: tuple[str, ...], seconds: float | None, *, as_json: bool, **options: Any) -> None:
    """Solve SOURCE for a rig and hand the poses to every SINK.

    SOURCE is natnet://HOST, udp://:PORT, camera:0, or a file: a take, a capture, markers (C3D, TRC, CSV), a video.
    Ctrl-C ends the run and completes every file; a second one does not wait for films to catch up.
    """
    report = perform(source, to or ("window",), seconds, options)
    click.echo(json.dumps(report.as_dict(), indent=2) if as_json else summary(report))
    if report.errors:
        raise RetargetError(" ".join(report.errors))


def perform(where: str, targets: tuple[str, ...], seconds: float | None, options: dict[str, Any]) -> RunReport:
    """Run it all and return what was done."""
    from retarget.pipeline import Run
    from retarget.sinks import WINDOW, takes_frames
    from retarget.sources import Paced, open_source

    files = tuple(target for target in targets if target != WINDOW)
    session = None if all(map(takes_frames, targets)) else _session(where, options)
    tap = (lambda _: None) if options["record"] else None
    open_source(where, tap, options["detector"])  # what cannot be is told before a take is made
    with ExitStack() as stack:
        recorder = stack.enter_context(_recorder(where, options)) if options["record"] else None
        opened = open_source(where, recorder, options["detector"])
        watched = WINDOW in targets or any(map(takes_frames, targets))
        source = Paced(opened) if watched and not opened.live else opened
        window = stack.enter_context(_window(options)) if WINDOW in targets else None
        run = Run(source, session, files, lambda opened: _settings(opened, options), window)
        stack.enter_context(stopped_by_signals(run.stop, run.abandon))
        stack.enter_context(stopped_after(seconds, run.stop))
        with run:
            _solve(run, source, window)
            _say_what_waits(run)
    return run.report()


def summary(report: RunReport) -> str:
    """The report in a few lines for a person."""
    from retarget.sinks import takes_frames

    lines = [", ".join(f"{count:,} {what}" for what, count in report.source.items())]
    lines.append(f"{report.poses:,} poses in {report.seconds:.1f} s")
    if report.latency_p50_ms is not None:
        lines.append(f"datagram to pose: p50 {report.latency_p50_ms:.2f} ms, p99 {report.latency_p99_ms:.2f} ms")
    for name, sink in report.sinks.items():
        dropped = f", {sink.dropped:,} dropped because it was too slow" if sink.dropped else ""
        what = "frames" if takes_frames(name) else "poses"
        lines.append(f"{name}: {sink.written:,} {what}{dropped}{', ended early' if sink.error else ''}")
    return "\n".join(lines)


def _recorder(where: str, options: dict[str, Any]) -> TakeRecorder:
    from retarget.cli.record import versions
    from retarget.take.metadata import TakeMetadata
    from retarget.take.recorder import TakeRecorder

    performer = options["performer"] or ""
    about = TakeMetadata(where, options["layout"] or "", options["rig"], performer, versions())
    return TakeRecorder(Path(options["record"]), about)


def _session(where: str, options: dict[str, Any]) -> Session:
    from retarget.markers.layouts import load_layout
    from retarget.performer import load_performer
    from retarget.performer_watch import PerformerWatch
    from retarget.rig.load import load_rig
    from retarget.session import Session, SolveSettings
    from retarget.sources import are_landmarks

    layout = load_layout(options["layout"]) if options["layout"] else None
    performer = load_performer(options["performer"]) if options["performer"] else None
    updates = PerformerWatch(Path(options["performer"])) if performer else lambda: None
    noisy = are_landmarks(where) or options["drive"] != "joints"  # weights amplify what markers tremble
    smooth: Smoothing = options["smooth"] or ("one-euro" if noisy else "none")
    how = SolveSettings(options["drive"], smooth, options["jaw"])
    return Session(load_rig(options["rig"]), performer, layout, how, updates)


def _settings(source: Source, options: dict[str, Any]) -> SinkSettings:
    from retarget.sampling import picture_rate_hz
    from retarget.sinks import SinkSettings

    return SinkSettings(
        rig=options["rig"],
        view=_view(options, supersampling=1 if source.live else 2),
        skinning=options["skinning"],
        picture_hz=options["fps"] or picture_rate_hz(source.rate_hz),
    )


def _view(options: dict[str, Any], supersampling: int) -> View:
    from math import radians

    from retarget.rig.display.view import View

    width, height = options["size"]
    return View(
        width=width,
        height=height,
        background=options["background"],
        framing=options["framing"],
        yaw_rad=radians(options["turn"]),
        supersampling=options["antialias"] or supersampling,
    )


def _window(options: dict[str, Any]) -> Window:
    from retarget.rig.display.window import Window
    from retarget.rig.load import load_rig
    from retarget.rig.skinning import Skin

    rig = load_rig(options["rig"])
    return Window(rig, _view(options, supersampling=1), Skin(rig, options["skinning"]))


def _solve(run: Run, source: Source, window: Window | None) -> None:
    if window is None:
        with _progress(source.frame_count) as on_frame:
            run.solve_all(on_frame)
        return
    failure: list[BaseException] = []

    def solve_beside() -> None:
        try:
            run.solve_all()
        except BaseException as error:
            failure.append(error)
        window.close()

    solver = threading.Thread(target=solve_beside, name="solver", daemon=True)
    solver.start()
    window.run()  # window systems insist on the main thread
    run.stop()
    solver.join()
    if failure:
        raise failure[0]


@contextmanager
def _progress(frames: int | None) -> Iterator[Callable[[], None]]:
    """A bar on a terminal, for a source whose length is known."""
    if frames is None or not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("solving", total=frames)
        yield lambda: progress.advance(task)


def _say_what_waits(run: Run) -> None:
    if run.unwritten > 100:
        click.echo(f"{run.unwritten:,} poses still wait to be written; Ctrl-C leaves them out.", err=True)
