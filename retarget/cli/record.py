"""`retarget record`."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from retarget.cli.ending import stopped_after, stopped_by_signals

if TYPE_CHECKING:
    from retarget.sources import Source
    from retarget.take.recorder import TakeRecorder

_REPORT_S = 1.0


@click.command()
@click.argument("source")
@click.argument("take", type=click.Path())
@click.option("--seconds", type=click.FloatRange(min=0, min_open=True), help="Stop after so long.")
def command(source: str, take: str, seconds: float | None) -> None:
    """Record SOURCE, such as natnet://HOST, to TAKE, a new .mcap file.

    Every datagram of both channels is kept as it came, so a better decoder can read it again. What is recorded reaches
    the disk within a quarter of a second; a take that is cut short by a crash is read up to there. Ctrl-C ends it.
    """
    from retarget.sources import open_source
    from retarget.take.metadata import TakeMetadata
    from retarget.take.recorder import TakeRecorder

    if Path(take).suffix.lower() != ".mcap":
        raise click.BadParameter(
            f"{take} must end in .mcap; convert it afterwards to other formats.", param_hint="TAKE"
        )
    open_source(source, tap=lambda _: None)  # what cannot be recorded is told before a file is made
    with TakeRecorder(Path(take), TakeMetadata(source=source, versions=versions())) as recorder:
        stream = open_source(source, tap=recorder)
        with stopped_by_signals(stream.stop), stopped_after(seconds, stream.stop), stream:
            _watch(stream, recorder)
    counts = ", ".join(f"{count:,} {what}" for what, count in stream.counts().items())
    click.echo(f"{counts}\n{take}: {recorder.recorded:,} datagrams")


def versions() -> dict[str, str]:
    """Versions of what takes part, for the take's metadata."""
    from importlib.metadata import version

    return {"retarget": version("retarget")}


def _watch(stream: Source, recorder: TakeRecorder) -> None:
    """Let the stream run, with a line about it every second on a terminal, until it or the recorder ends."""
    shown_s = time.monotonic()
    for frame in stream:
        if recorder.failure is not None:
            return
        if sys.stderr.isatty() and time.monotonic() - shown_s > _REPORT_S:
            shown_s = time.monotonic()
            counts = stream.counts()
            click.echo(
                f"\rframe {frame.number}, {counts['received']:,} received, {counts['lost']:,} lost ", err=True, nl=False
            )
