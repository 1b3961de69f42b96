"""Forms of option values that several commands share."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Mapping


class Size(click.ParamType[tuple[int, int]]):
    """WIDTHxHEIGHT in pixels."""

    name = "WIDTHxHEIGHT"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """(width, height); usage error for any other form."""
        match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", str(value))
        if not match:
            self.fail(f"{value!r} is not a size such as 1280x720.", param, ctx)
        return int(match[1]), int(match[2])


class Colour(click.ParamType[tuple[int, int, int]]):
    """R,G,B from 0 to 255, or #rrggbb."""

    name = "COLOUR"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int, int]:
        """(red, green, blue) sRGB bytes; usage error for any other form."""
        text = str(value)
        if match := re.fullmatch(r"#([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})", text):
            red, green, blue = (int(part, 16) for part in match.groups())
            return red, green, blue
        if (match := re.fullmatch(r"(\d{1,3}),(\d{1,3}),(\d{1,3})", text)) and max(map(int, match.groups())) <= 255:
            red, green, blue = (int(part) for part in match.groups())
            return red, green, blue
        return self.fail(f"{text!r} is not a colour such as 0,255,0 or #00ff00.", param, ctx)


def read_config(ctx: click.Context, param: click.Parameter, path: str | None) -> str | None:
    """Take the options in a TOML file as defaults of this command; a callback of an eager option."""
    if path is None:
        return None
    from pathlib import Path

    from retarget.toml_table import read_table

    table = read_table(Path(path), "session file")
    options = {p.name: p for p in ctx.command.params if p.name and p is not param}
    table.only(*(name.replace("_", "-") for name in options), *options)
    ctx.default_map = {**(ctx.default_map or {}), **_as_options(table.values)}
    return path


def _as_options(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name.replace("-", "_"): value for name, value in values.items()}
