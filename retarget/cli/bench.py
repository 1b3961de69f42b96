"""`retarget bench`."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import click

from retarget.errors import RetargetError


@click.command()
@click.argument("names", nargs=-1)
def command(names: tuple[str, ...]) -> None:
    """Print figures beside those of other people's programs; all benchmarks, or those of NAMES.

    They are part of the source tree, because the other programs are test dependencies.
    """
    root = Path(__file__).parents[2]
    if not (root / "tests" / "benchmarks" / "__main__.py").exists():
        raise RetargetError("The benchmarks are not installed with the package; run `make bench` in the source tree.")
    sys.path.insert(0, str(root))
    importlib.import_module("tests.benchmarks.__main__").main(list(names))
