"""One object of a glTF document, read strictly: every value has the type asked for, or the error says where it stands.

The document is foreign input, so a wrong type, a missing key or a number that is not finite ends in `InputError` with
the place of the value, never in a `KeyError`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable

LARGEST = 1e9
"""Beyond this a length, a scale or a colour is damage, and products of several would overflow."""


class Fields:
    """The keys and values of one object; `place` names it in messages, such as ``human.glb, accessors[3]``."""

    __slots__ = ("data", "place")

    def __init__(self, data: object, place: str) -> None:
        if not isinstance(data, dict):
            raise InputError(f"{place} should be a table of keys and values, not {data!r:.60}.")
        self.data: dict[str, object] = data
        self.place = place

    def __contains__(self, key: str) -> bool:
        return key in self.data

    def wrong(self, key: str, expected: str) -> InputError:
        """The error that says what `key` should have been."""
        if key not in self.data:
            return InputError(f"{self.place} lacks {key!r}, which should be {expected}.")
        return InputError(f"{self.place}: {key!r} should be {expected}, not {self.data[key]!r:.60}.")

    def integer(self, key: str, default: int | None = None) -> int:
        """A whole number from 0."""
        value = self.data.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise self.wrong(key, "a whole number from 0")
        return value

    def number(self, key: str, default: float | None = None) -> float:
        """A number smaller than `LARGEST`."""
        value = self.data.get(key, default)
        if not _is_number(value):
            raise self.wrong(key, "a number")
        return float(value)  # type: ignore[arg-type]  # checked just above

    def text(self, key: str, default: str | None = None) -> str:
        """A text that is not empty, unless the default is."""
        value = self.data.get(key, default)
        if not isinstance(value, str) or (not value and default is None):
            raise self.wrong(key, "a text")
        return value

    def flag(self, key: str) -> bool:
        """True or false; false where it is missing."""
        value = self.data.get(key, False)
        if not isinstance(value, bool):
            raise self.wrong(key, "true or false")
        return value

    def numbers(self, key: str, count: int, default: Iterable[float] | None = None) -> list[float]:
        """Exactly `count` numbers, each smaller than `LARGEST`."""
        value = self.data.get(key, default)
        if isinstance(value, list | tuple) and len(value) == count and all(map(_is_number, value)):
            return [float(v) for v in value]
        raise self.wrong(key, f"{count} numbers")

    def integers(self, key: str) -> list[int]:
        """A list of whole numbers from 0; empty where the key is missing."""
        value = self.data.get(key, [])
        if isinstance(value, list) and all(isinstance(v, int) and not isinstance(v, bool) and v >= 0 for v in value):
            return list(value)
        raise self.wrong(key, "a list of whole numbers from 0")

    def texts(self, key: str) -> list[str]:
        """A list of texts; empty where the key is missing."""
        value = self.data.get(key, [])
        if isinstance(value, list) and all(isinstance(v, str) for v in value):
            return list(value)
        raise self.wrong(key, "a list of texts")

    def table(self, key: str) -> Fields:
        """The object under `key`; an empty one where the key is missing."""
        return Fields(self.data.get(key, {}), f"{self.place}, {key}")

    def tables(self, key: str) -> list[Fields]:
        """The list of objects under `key`; empty where the key is missing."""
        value = self.data.get(key, [])
        if not isinstance(value, list):
            raise self.wrong(key, "a list")
        return [Fields(item, f"{self.place}, {key}[{i}]") for i, item in enumerate(value)]


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < LARGEST
