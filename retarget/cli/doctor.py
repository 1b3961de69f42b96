"""`retarget doctor`."""

from __future__ import annotations

import json
import logging
import shutil
import sys
import textwrap
from contextlib import closing, contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from retarget.errors import RetargetError

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator, Sequence

    from retarget.markers.layouts import Layout
    from retarget.rig.model import Rig
    from retarget.udp.natnet.diagnosis import Step

_MARKS = {"passed": ("✓", "green"), "warned": ("!", "yellow"), "failed": ("✗", "red"), "skipped": ("·", "bright_black")}
_NAME_WIDTH = 9
_INDENT = " " * (_NAME_WIDTH + 4)


@click.command()
@click.argument("source")
@click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    default=3.0,
    show_default=True,
    help="How long frames are watched.",
)
@click.option("--layout", help="Name of a layout, or the path of its TOML file.  [the one whose names fit best]")
@click.option("--rig", default="human", show_default=True, help="Whose sites the markers shall drive.")
@click.option("--json", "as_json", is_flag=True, help="For a script.")
def command(source: str, seconds: float, layout: str | None, rig: str, *, as_json: bool) -> None:
    """Walk the connection to SOURCE, natnet://HOST, step by step, and name the step that fails.

    natnet:// without a host searches the network. The exit status is 1 if a step failed.
    """
    steps = []
    with closing(examine(source, seconds, layout, rig)) as examination, _quiet():
        for step in examination:
            steps.append(step)
            if not as_json and not _is_left_out(step):
                _show(step)
    if as_json:
        click.echo(json.dumps({"source": source, "steps": [_plain(step) for step in steps]}, indent=2))
    elif left_out := [step.name for step in steps if _is_left_out(step)]:
        click.echo(click.style(f"{_writable('·')} not examined: {', '.join(left_out)}", dim=True))
    for step in steps:
        if step.outcome.value == "failed":
            advice = f" To help, {step.advice}." if step.advice else ""
            raise RetargetError(f"{source} fails at the step {step.name!r}: {step.found}.{advice}")


def examine(source: str, seconds: float, layout: str | None, rig: str) -> Generator[Step, None, None]:
    """The steps of the connection, and at the end whether its markers drive the rig.

    Raises `InputError` for an address, a layout or a rig that cannot be had, before anything is examined.
    """
    from retarget.markers.layouts import available_layouts, load_layout
    from retarget.rig.load import load_rig
    from retarget.udp.natnet.diagnosis import Outcome, Step
    from retarget.udp.natnet.doctor import VITAL, Examination

    examination = Examination(source, watch_s=seconds)
    layouts = [load_layout(name) for name in ((layout,) if layout is not None else available_layouts())]
    driven = load_rig(rig)
    failed = ""
    for step in examination.steps():
        yield step
        if step.outcome is Outcome.FAILED and step.name in {*VITAL, "names"}:
            failed = failed or step.name
    if failed:
        yield Step("layout", Outcome.SKIPPED, "not examined", f"{failed} failed")
    else:
        yield judge_layout(examination.marker_names, layouts, driven)


def judge_layout(names: Sequence[str], layouts: Sequence[Layout], rig: Rig) -> Step:
    """Whether one of the layouts fits the marker names, and how many sites of the rig they drive then."""
    from retarget.udp.natnet.diagnosis import Outcome, Step
    from retarget.udp.natnet.verdicts import shortened

    counts = [layout.sites_in(names) for layout in layouts]
    known = ", ".join(layout.name for layout in layouts)
    if max(counts) == 0:
        return Step(
            "layout",
            Outcome.FAILED,
            f"none of the {len(names)} marker names is known: {shortened(names)}",
            f"the markers have other names than the layout expects (looked at: {known})",
            "rename them on the server, or write a layout that lists their names as aliases, and give it as --layout",
        )
    if counts.count(max(counts)) > 1:
        tied = " and ".join(layout.name for layout, count in zip(layouts, counts, strict=True) if count == max(counts))
        return Step("layout", Outcome.FAILED, f"{tied} fit the names equally well", advice="choose one with --layout")
    layout = layouts[counts.index(max(counts))]
    return _judge_fit(names, layout, rig)


def _judge_fit(names: Sequence[str], layout: Layout, rig: Rig) -> Step:
    from retarget.udp.natnet.diagnosis import Outcome, Step
    from retarget.udp.natnet.verdicts import shortened

    markers, at = layout.markers, layout.match(names).at
    driven = {site for site, index in zip(markers.sites, at, strict=True) if site in rig.sites and index >= 0}
    missing = [name for name, index in zip(markers.names, at, strict=True) if index < 0]
    found = f"{layout.name}: {len(at) - len(missing)} of its {len(at)} markers, "
    found += f"which drive {len(driven)} of the {len(rig.sites)} sites of the rig {rig.name}"
    if not missing:
        return Step("layout", Outcome.PASSED, found)
    return Step(
        "layout",
        Outcome.WARNED,
        f"{found}; missing: {shortened(missing)}",
        "they are not worn, or have other names",
        "rename them, or write a layout that lists their names as aliases",
    )


@contextmanager
def _quiet() -> Iterator[None]:
    """The steps tell what the connection would warn of; its own words come with --verbose only."""
    log = logging.getLogger("retarget.natnet")
    before = log.level
    log.setLevel(before if log.isEnabledFor(logging.INFO) else logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(before)


def _is_left_out(step: Step) -> bool:
    """Skipped for what failed before."""
    return step.outcome.value == "skipped" and step.cause != ""


def _plain(step: Step) -> dict[str, str]:
    return {**asdict(step), "outcome": step.outcome.value}


def _show(step: Step) -> None:
    mark, colour = _MARKS[step.outcome.value]
    width = shutil.get_terminal_size((110, 24)).columns if sys.stdout.isatty() else 110
    dim = step.outcome.value == "skipped"
    lines = textwrap.wrap(step.found, width - len(_INDENT)) or [""]
    click.echo(f"{click.style(_writable(mark), fg=colour, bold=True)} {step.name:<{_NAME_WIDTH}}  ", nl=False)
    click.echo(click.style(f"\n{_INDENT}".join(lines), dim=dim))
    for text, lead in ((step.cause, "because "), (step.advice, "→ ")):
        if text:
            wrapped = textwrap.wrap(_writable(lead) + text, width - len(_INDENT))
            click.echo(click.style(_INDENT + f"\n{_INDENT}".join(wrapped), dim=lead != "→ "))


def _writable(mark: str) -> str:
    """The mark, or a plain one on a terminal without it."""
    try:
        mark.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return {"✓": "+", "✗": "x", "·": "-", "→ ": "> "}.get(mark, mark)
    return mark
