"""The work behind `python -m calib performer`: takes are read, the calibration is made, progress is shown."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calib.calibration import STEPS, Settings, calibrate
from calib.material import Material, RangeTake
from calib.neutral import find_neutral
from calib.recording import read_recording
from calib.reference_poses import read_poses
from retarget.errors import InputError
from retarget.markers.layouts import load_layout
from retarget.performer import load_performer
from retarget.rig.load import load_rig

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from calib.calibration import Calibration
    from calib.recording import Recording
    from retarget.markers.layouts import Layout

FIRST_S = 2.0
"""Of a take that begins with its neutral."""


def calibrated(output: Path, options: dict[str, Any]) -> Calibration:
    """The calibration for the options of the command line; a performer file at `output` gives its fixed values."""
    previous = load_performer(output) if output.exists() else None
    settings = Settings(options["name"] or output.stem, tuple(options["bounds"]), previous)
    layout = load_layout(options["layout"]) if options["layout"] else None
    rig = load_rig(options["rig"])
    if previous and previous.fixed and previous.rig != rig.name:
        raise InputError(f"{output} has fixed values for the rig {previous.rig!r}; give another file for {rig.name!r}.")
    if options["live"]:
        from calib.guided import guided_material

        material = guided_material(options["live"], rig, layout, options["record"], options["seconds"])
    with progress() as on_step:
        if not options["live"]:
            on_step("takes")
            material = read_material(options["neutral"], options["rom"], options["poses"], layout)
        return calibrate(material, material.takes[0].recording.layout, rig, settings, on_step)


def read_material(neutral: Sequence[str], rom: Sequence[str], poses: str | None, layout: Layout | None) -> Material:
    """The takes; InputError where they do not share a layout, or a neutral is not still."""
    neutral = neutral or rom[:1]
    takes: dict[str, Recording] = {}
    for where in (*rom, *neutral):
        if where not in takes:
            takes[where] = read_recording(where, layout)
    _require_one_layout(takes)
    still = {where: find_neutral(takes[where], FIRST_S if where in rom else None) for where in dict.fromkeys(neutral)}
    first = still[neutral[0]]
    return Material(
        first,
        tuple(RangeTake(takes[where], still.get(where)) for where in rom),
        tuple(read_poses(poses, layout)) if poses else (),
    )


def _require_one_layout(takes: dict[str, Recording]) -> None:
    layouts = {recording.layout.name: where for where, recording in takes.items()}
    if len(layouts) > 1:
        named = " and ".join(f"{Path(where).name} ({name})" for name, where in layouts.items())
        raise InputError(f"The takes have different marker layouts: {named}; calibrate from takes of one layout.")


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """A bar on a terminal, which moves on with every step that begins."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:12}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=len(STEPS) + 1)

        def on_step(name: str) -> None:
            bar.update(task, advance=1, description=name)

        yield on_step
