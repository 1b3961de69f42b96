"""`retarget replay`."""

from __future__ import annotations

import signal
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from retarget.udp.natnet.pacing import Pace
    from retarget.udp.natnet.reel import Reel
    from retarget.udp.natnet.server import ServerSettings

MULTICAST_HELP = "Send to this group, such as 239.255.42.99, instead of to each client."


@click.command()
@click.argument("take", type=click.Path())
@click.option("--natnet", "host", default="127.0.0.1", show_default=True, help="Address of this machine to serve on.")
@click.option("--port", type=click.IntRange(0, 65535), default=1510, show_default=True, help="Command port.")
@click.option("--bitstream", default="4.1", show_default=True, help="2.5 to 4.3; a client may ask for an older one.")
@click.option("--speed", type=float, default=1.0, show_default=True, help="Seconds of the take per second.")
@click.option("--loop", is_flag=True, help="Begin again after the last frame.")
@click.option("--rate", type=float, metavar="HZ", help="A steady rate instead of the take's own times.")
@click.option("--fast", is_flag=True, help="As fast as this machine can send.")
@click.option("--multicast", metavar="GROUP", help=MULTICAST_HELP)
@click.option("--data-port", type=click.IntRange(1, 65535), default=1511, show_default=True, help="Port of the group.")
@click.option("--at-once", is_flag=True, help="Do not wait for the first client.")
def command(take: str, **options: Any) -> None:
    """Serve TAKE as a live NatNet server, which any NatNet client can connect to.

    It begins with the first client, ends after the last frame, and can be stopped by Ctrl-C.
    """
    from retarget.udp.natnet.server import NatNetServer

    reel = open_reel(Path(take))
    with NatNetServer(reel, _settings(options)) as server:
        click.echo(f"Serving {take} at natnet://{server.address[0]}:{server.address[1]}", err=True)
        asked = threading.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: asked.set())
        while not asked.is_set() and not server.wait(0.2):
            pass
        click.echo(f"{server.frames_sent:,} frames played, {server.datagrams_unsent:,} datagrams could not be sent")


def open_reel(take: Path) -> Reel:
    """What there is to play in a take; InputError for a file that holds no markers."""
    from retarget.take.convert import TAKES, read_clip
    from retarget.take.reader import read_take
    from retarget.take.reel import TakeReel
    from retarget.udp.natnet.reel import MarkerReel

    if take.suffix.lower() in TAKES:
        return TakeReel(read_take(take))
    clip = read_clip(take)
    return MarkerReel(list(clip), rate_hz=clip.rate_hz)


def _settings(options: dict[str, Any]) -> ServerSettings:
    from retarget.udp.natnet.playback import AtEnd
    from retarget.udp.natnet.player import Begin
    from retarget.udp.natnet.server import ServerSettings
    from retarget.udp.natnet.version import parse_bitstream

    return ServerSettings(
        host=options["host"],
        command_port=options["port"],
        bitstream=parse_bitstream(options["bitstream"]),
        multicast=options["multicast"],
        data_port=options["data_port"],
        pace=_pace(options["rate"], fast=options["fast"]),
        speed=options["speed"],
        at_end=AtEnd.LOOP if options["loop"] else AtEnd.STOP,
        begin=Begin.AT_ONCE if options["at_once"] else Begin.WITH_FIRST_CLIENT,
    )


def _pace(rate_hz: float | None, *, fast: bool) -> Pace:
    from retarget.udp.natnet.pacing import FastestPace, OriginalPace, SteadyPace

    if fast:
        return FastestPace()
    return OriginalPace() if rate_hz is None else SteadyPace(rate_hz)
