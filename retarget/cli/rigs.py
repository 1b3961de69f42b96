"""`retarget rigs`."""

from __future__ import annotations

import json
from dataclasses import asdict

import click


@click.command()
@click.option("--json", "as_json", is_flag=True, help="For a script.")
def command(*, as_json: bool) -> None:
    """List the rigs that can be driven, with what they have."""
    from retarget.rig.load import available_rigs

    rigs = available_rigs()
    if as_json:
        click.echo(json.dumps([{**asdict(rig), "path": str(rig.path)} for rig in rigs], indent=2))
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("rig", "joints", "sites", "blend shapes", "vertices", "licence", box=None)
    for rig in rigs:
        table.add_row(rig.name, str(rig.joints), str(rig.sites), str(rig.shapes), f"{rig.vertices:,}", rig.licence)
    Console().print(table)
