"""`retarget remote`."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import click

if TYPE_CHECKING:
    from collections.abc import Callable

    from retarget.udp.natnet.client import NatNetClient


class Order(NamedTuple):
    """Something that a server can be told to do."""

    parameters: tuple[str, ...]
    does: str
    carry_out: Callable[..., object]


ORDERS = {
    "start-recording": Order((), "begin to record", lambda server: server.start_recording()),
    "stop-recording": Order((), "end the recording", lambda server: server.stop_recording()),
    "name-take": Order(("NAME",), "name of the next recording", lambda server, name: server.set_record_take_name(name)),
    "open-take": Order(("NAME",), "take to play back", lambda server, name: server.set_playback_take_name(name)),
    "play": Order((), "play back", lambda server: server.play()),
    "pause": Order((), "hold the playback", lambda server: server.pause()),
    "seek": Order(("FRAME",), "go to a frame", lambda server, frame: server.jump(int(frame))),
    "range": Order(("FIRST", "LAST"), "play these only", lambda server, a, b: server.play_range(int(a), int(b))),
}
HELP = "\n\n\b\n" + "\n".join(f"{name} {' '.join(o.parameters)}".ljust(26) + o.does for name, o in ORDERS.items())


@click.command(help=f"Tell the server at ADDRESS (natnet://HOST) what to do.{HELP}")
@click.argument("address")
@click.argument("order", type=click.Choice(list(ORDERS)))
@click.argument("values", nargs=-1)
def command(address: str, order: str, values: tuple[str, ...]) -> None:
    """Give one order and wait until the server has confirmed it."""
    wanted = ORDERS[order].parameters
    if len(values) != len(wanted):
        raise click.UsageError(f"{order} takes {' and '.join(wanted) or 'nothing'}; {len(values)} given.")
    numbers = [v for v, name in zip(values, wanted, strict=True) if name != "NAME"]
    if not all(number.isascii() and number.isdigit() for number in numbers):
        raise click.UsageError(f"{order} takes whole frame numbers from 0, not {', '.join(numbers)}.")
    with _client(address) as server:
        ORDERS[order].carry_out(server, *values)
    click.echo(f"{order}: done")


def _client(address: str) -> NatNetClient:
    from retarget.errors import InputError
    from retarget.udp.natnet.client import NatNetClient
    from retarget.udp.natnet.url import parse_natnet_url

    url = parse_natnet_url(address)
    if url.host is None:
        raise InputError("remote needs to know the server: natnet://HOST.")
    return NatNetClient(url.host, url.port, local=url.local)
