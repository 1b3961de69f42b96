"""The command `retarget`.

Numbers go to stdout, logs to stderr; exit status 0, 1 (it failed: one sentence why and what to do) or 2 (wrong usage).
"""

from __future__ import annotations

import importlib
import logging
import sys

import click

from retarget.errors import RetargetError

COMMANDS = {
    "run": "Solve a source for a rig: to a window, films, pictures and tables.",
    "record": "Record a live stream, whole and safe from crashes.",
    "replay": "Serve a take as a live NatNet server.",
    "convert": "Change a take's or a marker file's format.",
    "inspect": "Show what is in a take, a rig or a performer file.",
    "doctor": "Find out why a live stream does not come, step by step.",
    "models": "List or fetch the models that find landmarks in pictures.",
    "remote": "Tell a NatNet server to record or to play back.",
    "bench": "Print figures beside those of other programs.",
    "rigs": "List the rigs that can be driven, or add one.",
}


class Commands(click.Group):
    """Loads a command's module when it is called, and turns our errors into one sentence and status 1."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        """In the order of use."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """The command object, None for an unknown name."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = importlib.import_module(f"retarget.cli.{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """The list in the help text, without loading any command."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

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
    """Markers in, a living face out."""
    logging.basicConfig(
        stream=sys.stderr, level=logging.INFO if verbose else logging.WARNING, format="%(message)s", force=True
    )
