"""A strict reader of TOML files that people edit: what is missing, misspelt or wrong is an InputError with its place.

A misspelt key that is passed over looks like an option that does nothing; so no key is passed over. TOML 1.0.
"""

from __future__ import annotations

import datetime
import difflib
import re
import tomllib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MAX_FILE_BYTES = 4_000_000
LARGEST = 1e100


def read_table(path: Path, kind: str) -> Table:
    """The root table of the file at `path`, which is a `kind` (for messages, as in "performer file")."""
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise InputError(f"{path} is too large for a {kind}, which may hold {MAX_FILE_BYTES} bytes.")
        text = path.read_text("utf-8")
        return Table(tomllib.loads(text), "", path, text)
    except OSError as error:
        raise InputError(f"The {kind} {path} cannot be read: {error.strerror}.") from error
    except (
        ValueError,
        RecursionError,
    ) as error:  # not UTF-8, not TOML, a number of thousands of digits, brackets without end
        raise InputError(f"{path} is not a TOML text: {error}.") from error


@dataclass(frozen=True, slots=True)
class Table:
    """A table of the file with its place; every getter raises InputError in one sentence."""

    values: Mapping[str, object]
    name: str
    path: Path
    text: str

    def only(self, *keys: str) -> None:
        """Refuse every key but `keys`, naming the nearest of them."""
        for key in self.values:
            if key not in keys:
                near = difflib.get_close_matches(key, keys, n=1)
                advice = f"did you mean {near[0]!r}?" if near else f"the keys here are {', '.join(keys)}."
                raise InputError(f"{self.path}: unknown key {self.place(key)}; {advice}")

    def get(self, key: str) -> object:
        """The value of `key`, which must be there."""
        if key not in self.values:
            raise InputError(f"{self.path}: the key {self.place(key)} is missing.")
        return self.values[key]

    def table(self, key: str) -> Table:
        """The table `key`, empty where there is none."""
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            raise self.wrong(key, "must be a table")
        return Table(value, key, self.path, self.text)

    def string(self, key: str) -> str:
        """The text `key`."""
        value = self.get(key)
        if not isinstance(value, str):
            raise self.wrong(key, "must be a text in quotes")
        return value

    def strings(self, key: str) -> tuple[str, ...]:
        """The list `key` of different texts."""
        value = self.get(key)
        if not isinstance(value, list) or not all(isinstance(v, str) for v in value) or len(set(value)) < len(value):
            raise self.wrong(key, "must be a list of different names in quotes")
        return tuple(value)

    def date(self, key: str) -> datetime.date:
        """The day `key`."""
        value = self.get(key)
        if type(value) is not datetime.date:
            raise self.wrong(key, "must be a date such as 2026-01-31")
        return value

    def array(self, key: str, *shapes: tuple[int, ...]) -> Array:
        """The finite number or numbers `key`, in one of `shapes`: (), (2,), (3,), (6,) or (3, 3)."""
        value = self.get(key)
        forms = {
            (): "a number",
            (2,): "two numbers",
            (3,): "three numbers",
            (6,): "six numbers",
            (3, 3): "three rows of three numbers",
        }
        array = _finite(value)
        if array is None or array.shape not in shapes:
            raise self.wrong(key, f"must be {' or '.join(forms[s] for s in shapes)}, all finite")
        return array

    def number(self, key: str) -> float:
        """The finite number `key`."""
        return float(self.array(key, ()))

    def wrong(self, key: str, rule: str) -> InputError:
        """The error to raise where `key` breaks `rule`."""
        return InputError(f"{self.path}: {self.place(key)} {rule}.")

    def place(self, key: str) -> str:
        """Where `key` stands, in words."""
        line = _line_of(self.text, self.name, key)
        where = [f"in [{self.name}]"] if self.name else []
        where += [f"on line {line}"] if line else []
        return " ".join([repr(key), *where])


def _finite(value: object) -> Array | None:
    """`value` as an array, None where it holds anything but finite numbers in rows of one length."""
    rows = value if isinstance(value, list) else [value]
    flat = [v for row in rows for v in (row if isinstance(row, list) else [row])]
    if not all(isinstance(v, int | float) and not isinstance(v, bool) and abs(v) < LARGEST for v in flat):
        return None
    try:
        return np.array(value, float)
    except ValueError:
        return None


def _line_of(text: str, table: str, key: str) -> int | None:
    """The line on which `key` of `table` is given; None where it cannot be told, as inside a table on one line."""
    current = ""
    for number, line in enumerate(text.split("\n"), 1):
        if heading := re.match(r"\s*\[([^\[\]]+)\]", line):
            current = heading[1].strip().strip("\"'")
        elif current == table and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=", line):
            return number
    return None
