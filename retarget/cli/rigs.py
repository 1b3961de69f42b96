"""`retarget rigs`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from retarget.rig.adopt import Adoption

SHOWN = 12
"""Names in a list before the rest is only counted."""


@click.group(invoke_without_command=True)
@click.option("--json", "as_json", is_flag=True, help="For a script.")
@click.pass_context
def command(context: click.Context, *, as_json: bool) -> None:
    """List the rigs that can be driven, with what they have; or add one."""
    if context.invoked_subcommand:
        return
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


@command.command("add")
@click.argument("model", type=click.Path(exists=True, path_type=Path))
@click.option("--name", help="What the rig is called from now on.  [as the file]")
@click.option("--json", "as_json", is_flag=True, help="For a script.")
def add(model: Path, name: str | None, *, as_json: bool) -> None:
    """Make a rig of MODEL: a .glb or .vrm with a skin or blend shapes, or a folder of OBJ files, one a shape.

    The model is copied to the user's folder of rigs (RETARGET_RIGS, or retarget/rigs in the data folder) with a
    rig.toml that can be edited; --rig NAME finds it there.
    """
    from retarget.rig.adopt import adopt
    from retarget.rig.library import user_folder

    adoption = adopt(model, user_folder(), name)
    if as_json:
        click.echo(json.dumps({**asdict(adoption), "folder": str(adoption.folder)}, indent=2))
        return
    for line in _report(adoption):
        click.echo(line)


def _report(adoption: Adoption) -> list[str]:
    lines = [
        f"{adoption.name}: {adoption.folder}",
        f"joints: {', '.join(f'{role} = {joint}' for role, joint in adoption.joints.items())}",
        f"sites: {adoption.site_joints} with a joint, {adoption.site_places} as places on the mesh",
        f"blend shapes: {len(adoption.shapes)} of ARKit's {len(adoption.shapes) + len(adoption.missing)}",
    ]
    if adoption.approximate:
        lines.append(f"only the nearest: {_some(adoption.approximate)}")
    if adoption.missing and adoption.shapes:
        lines.append(f"not there: {_some(adoption.missing)}")
    if adoption.unmapped:
        lines.append(f"not understood: {_some(adoption.unmapped)}")
    return [*lines, *adoption.notes, f"Drive it with --rig {adoption.name}."]


def _some(names: tuple[str, ...]) -> str:
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return f"{len(names)}: {', '.join(names[:SHOWN])}{more}"
