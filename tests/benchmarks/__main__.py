"""Runs every `bench_*.py` beside this file, or those named, and prints one table."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table


def main(names: list[str]) -> None:
    """Print the rows of each benchmark as they come."""
    found = sorted(p.stem.removeprefix("bench_") for p in Path(__file__).parent.glob("bench_*.py"))
    console = Console(width=150)
    for name in names or found:
        if name not in found:
            sys.exit(f"There is no benchmark named {name!r}; there are: {', '.join(found)}.")
        module = importlib.import_module(f"tests.benchmarks.bench_{name}")
        table = Table("measured", "ours", "peer", "ours / peer", "aim", title=name, title_justify="left")
        for row in module.rows():
            peer = "" if row.peer_value is None else f"{row.peer_value:,.4g} {row.unit} ({row.peer})"
            ratio = "" if row.ratio is None else f"{row.ratio:.3g}"
            table.add_row(row.what, f"{row.value:,.4g} {row.unit}", peer, ratio, row.aim)
        console.print(table)


if __name__ == "__main__":
    main(sys.argv[1:])
