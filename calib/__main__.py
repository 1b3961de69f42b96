"""The command `python -m calib`, also `retarget-calibrate`.

Results go to stdout, progress to stderr on a terminal; exit status 0, 1 (it failed: one sentence why and what to do)
or 2 (wrong usage).
"""

from __future__ import annotations

import json
import logging
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget.errors import RetargetError

if TYPE_CHECKING:
    from calib.calibration import Calibration

DEFAULT_BOUNDS = (0.25, 1.0)


class Commands(click.Group):
    """Turns our errors into one sentence and status 1."""

    def invoke(self, ctx: click.Context) -> object:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except RetargetError as error:
            raise click.ClickException(str(error)) from error


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="retarget")
@click.option("-v", "--verbose", is_flag=True, help="Say more about what happens.")
def main(*, verbose: bool) -> None:
    """Make what the runtime loads: a performer's calibration out of short takes."""
    level = logging.INFO if verbose else logging.WARNING
    logging.basicConfig(stream=sys.stderr, level=level, format="%(message)s", force=True)


class ManyTakes(click.Command):
    """Lets an option that may come more than once take several values at a time: --rom a.c3d b.c3d."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Repeat the option's name before each of its values."""
        spread: list[str] = []
        many = {name for p in self.params if isinstance(p, click.Option) and p.multiple for name in p.opts}
        current = ""
        for arg in args:
            if arg.startswith("-"):
                current = arg if arg in many else ""
            elif current and spread[-1] != current:
                spread.append(current)
            spread.append(arg)
        return super().parse_args(ctx, spread)


@main.command(cls=ManyTakes)
@click.option(
    "--neutral", multiple=True, metavar="TAKE", help="A face at rest, two seconds or more.  [the first --rom]"
)
@click.option("--rom", multiple=True, metavar="TAKE", help="A range of motion; as many as there are.")
@click.option("--poses", metavar="FOLDER|LIST", help="Named poses of the rig that the performer mimicked.")
@click.option("--from", "live", metavar="natnet://HOST", help="Guide the performer through it, live.")
@click.option("--record", metavar="TAKE.mcap", help="With --from: keep everything that comes.")
@click.option(
    "--seconds", type=click.FloatRange(1, 60), default=5.0, show_default=True, help="With --from: each prompt."
)
@click.option("--rig", default="human", show_default=True, help="Name, or the path of a rig.toml.")
@click.option("--layout", help="Name of the marker layout, or the path of a card.  [found by the names]")
@click.option("--name", help="The performer's.  [as the output file]")
@click.option(
    "--bounds", nargs=2, type=float, default=DEFAULT_BOUNDS, show_default=True, help="Of K over the ratio of sizes."
)
@click.option("-o", "--output", required=True, metavar="FILE.toml", type=click.Path(), help="The performer file.")
@click.option("--report", metavar="FILE.html", type=click.Path(), help="The report, one page.")
@click.option("--json", "as_json", is_flag=True, help="The report for a script, on stdout.")
def performer(output: str, report: str | None, *, as_json: bool, **options: Any) -> None:
    """Calibrate a performer: K, jaw and neutral, from a still face and a range of motion.

    Takes are any file that `retarget run` takes. A take that is given both as --neutral and as --rom begins with its
    neutral: its first two seconds are searched for it. Values that an earlier OUTPUT calls fixed are kept.
    """
    if bool(options["live"]) == bool(options["rom"]):
        raise click.UsageError("Give takes with --rom, or a live source with --from.")
    if options["record"] and not options["live"]:
        raise click.UsageError("--record goes with --from.")
    from calib.performer_command import calibrated
    from retarget.performer import save_performer

    calibration = calibrated(Path(output), options)
    save_performer(calibration.performer, output)
    if report:
        _write_report(calibration, Path(report))
    _tell(calibration, output, report, as_json)


def _write_report(calibration: Calibration, path: Path) -> None:
    from calib.pictures import pictures
    from calib.report_html import page
    from retarget.errors import OutputError

    text = page(calibration, *pictures(calibration))
    try:
        path.write_text(text, "utf-8")
    except OSError as error:
        raise OutputError(f"The report {path} cannot be written: {error.strerror}.") from error


def _tell(calibration: Calibration, output: str, report: str | None, as_json: bool) -> None:
    from rich.console import Console

    from calib.findings import findings
    from calib.report import facts, terminal_table

    if as_json:
        click.echo(json.dumps(facts(calibration), indent=2))
        return
    Console(width=None if sys.stdout.isatty() else 110).print(terminal_table(calibration))
    for finding in findings(calibration):
        click.echo(f"- {finding.text}")
    click.echo(f"{output} is written{f', and {report}' if report else ''}.")


if __name__ == "__main__":
    main()
