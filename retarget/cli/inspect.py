"""`retarget inspect`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget.errors import InputError

if TYPE_CHECKING:
    from retarget.performer import Performer
    from retarget.rig.model import Rig
    from retarget.take.analysis import Inspection


@click.command()
@click.argument("what")
@click.option("--json", "as_json", is_flag=True, help="For a script.")
@click.option("--plot", type=click.Path(), help="Draw gaps and inter-arrival times to this .png, .svg or .pdf.")
def command(what: str, plot: str | None, *, as_json: bool) -> None:
    """Show what is in WHAT: a take, a marker file, a rig (by name or file) or a performer file.

    Of a take: channels, versions, rates, jitter, frames lost and doubled, and the gaps of every marker.
    """
    from retarget.take.convert import CLIPS, TAKES

    path = Path(what)
    if path.suffix.lower() in TAKES + CLIPS:
        inspection = _inspection(path)
        if plot:
            from retarget.take.plots import plot_inspection

            plot_inspection(inspection, Path(plot))
        _show(inspection.as_dict(), as_json, lambda: _print_take(inspection))
        return
    if plot:
        raise InputError(f"Only takes and marker files have gaps to plot; {what} is neither.")
    if path.suffix.lower() == ".toml" and path.is_file() and "performer" in path.read_text("utf-8", "replace"):
        from retarget.performer import load_performer

        performer = load_performer(path)
        _show(performer_facts(performer), as_json, lambda: _print_performer(performer))
        return
    from retarget.rig.load import load_rig

    rig = load_rig(what)
    _show(rig_facts(rig), as_json, lambda: _print_facts(rig_facts(rig)))


def rig_facts(rig: Rig) -> dict[str, Any]:
    """What can be said of a rig in numbers and names."""
    return {
        "rig": rig.name,
        "file": str(rig.path),
        "joints": list(rig.joints.names),
        "sites": list(rig.sites),
        "blend shapes": list(rig.shape_names),
        "vertices": sum(len(surface.positions) for surface in rig.surfaces),
        "triangles": sum(len(surface.triangles) for surface in rig.surfaces),
        "surfaces": [surface.name for surface in rig.surfaces],
        "licence": rig.licence,
    }


def performer_facts(performer: Performer) -> dict[str, Any]:
    """What can be said of a performer in numbers and names; lengths in metres, angles in radians."""
    jaw = performer.jaw
    return {
        "performer": performer.name,
        "rig": performer.rig,
        "layout": performer.layout,
        "date": performer.date.isoformat(),
        "scale": performer.scale,
        "markers": list(performer.markers),
        "head markers": list(performer.head_markers),
        "jaw": {"axis": jaw.axis.tolist(), "pivot": jaw.pivot.tolist(), "gain": jaw.gain} if jaw else None,
        "K": {site: K.tolist() for site, K in performer.K.items()},
        "ranges": {site: reach.tolist() for site, reach in performer.ranges.items()},
        "quality": dict(performer.quality),
        "fixed": list(performer.fixed),
    }


def _inspection(path: Path) -> Inspection:
    from retarget.take.analysis import inspect_clip, inspect_take
    from retarget.take.convert import TAKES, read_clip
    from retarget.take.reader import read_take

    return inspect_take(read_take(path)) if path.suffix.lower() in TAKES else inspect_clip(read_clip(path))


def _show(facts: dict[str, Any], as_json: bool, show: Any) -> None:
    if as_json:
        click.echo(json.dumps(facts, indent=2))
    else:
        show()


def _print_facts(facts: dict[str, Any]) -> None:
    for name, value in facts.items():
        if isinstance(value, list):
            text = f"{len(value)}: {', '.join(map(str, value))}"
        elif isinstance(value, dict):
            text = "; ".join(f"{key}: {item}" for key, item in value.items())
        else:
            text = str(value)
        click.echo(f"{name}: {text}")


def _print_performer(performer: Performer) -> None:
    from rich.console import Console
    from rich.table import Table

    facts = performer_facts(performer)
    _print_facts({name: facts[name] for name in ("performer", "rig", "layout", "date", "scale")})
    _print_facts({name.replace("_", " "): f"{value:.4g}" for name, value in performer.quality.items()})
    if performer.fixed:
        _print_facts({"fixed by hand": facts["fixed"]})
    table = Table("site", "K left", "right", "up", "down", "forward", "back", "went up", "down [mm]", box=None)
    for site, K in performer.K.items():
        positive, negative = (K, K) if K.ndim == 2 else K
        gains = [f"{gain[i, i]:.2f}" for i in range(3) for gain in (positive, negative)]
        reach = performer.ranges.get(site)
        table.add_row(site, *gains, *([] if reach is None else [f"{1e3 * abs(side[1]):.1f}" for side in reach]))
    Console(width=None if sys.stdout.isatty() else 120).print(table)


def _print_take(inspection: Inspection) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(width=None if sys.stdout.isatty() else 120)
    rate = f" at {inspection.rate_hz:g} Hz" if inspection.rate_hz else ""
    click.echo(f"{inspection.path}: {inspection.frames.received:,} frames{rate}, {inspection.duration_s:.2f} s")
    for name, fact in inspection.facts.items():
        click.echo(f"{name}: {fact}")
    frames = inspection.frames
    click.echo(
        f"frames {frames.first_number} to {frames.last_number}: {frames.lost:,} lost, {frames.doubled:,} doubled, "
        f"{frames.late:,} late, {frames.malformed:,} malformed"
    )
    if inspection.channels:
        table = Table("channel", "direction", "datagrams", "bytes", "rate", "p50", "p99", "longest", box=None)
        for c in inspection.channels:
            steps = (
                [f"{x:.2f} ms" for x in (c.interval.p50_ms, c.interval.p99_ms, c.interval.max_ms)] if c.interval else []
            )
            table.add_row(c.channel, c.direction, f"{c.datagrams:,}", f"{c.octets:,}", f"{c.rate_hz:.1f} Hz", *steps)
        console.print(table)
    _print_markers(inspection, console)
    for note in inspection.notes:
        click.echo(note)


def _print_markers(inspection: Inspection, console: Any) -> None:
    from rich.table import Table

    gappy = [marker for marker in inspection.markers if marker.gaps]
    click.echo(f"{len(inspection.markers)} markers, {len(gappy)} of them with gaps")
    if gappy:
        table = Table("marker", "seen", "gaps", "longest gap", box=None)
        for marker in gappy:
            table.add_row(marker.name, f"{marker.seen:.1%}", f"{marker.gaps:,}", f"{marker.longest_gap_s:.3f} s")
        console.print(table)
