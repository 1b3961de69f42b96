"""`retarget convert`."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("source", type=click.Path())
@click.argument("target", type=click.Path())
def command(source: str, target: str) -> None:
    """Write what is in SOURCE to TARGET; their endings say the formats.

    Takes of datagrams: .mcap, .pcapng (Wireshark's) and, to read only, .pcap. Markers: .c3d, .trc and .csv (Motive's).
    Names, rate, gaps and times are kept; what a format cannot hold is told.
    """
    from retarget.take.convert import convert

    conversion = convert(Path(source), Path(target))
    for note in conversion.notes:
        click.echo(note, err=True)
    click.echo(f"{conversion.target}: {conversion.count:,} {conversion.unit}")
