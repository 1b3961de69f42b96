"""How the guide speaks with whoever sits before it."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Protocol

from retarget.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable


class Talk(Protocol):
    """How the guide speaks with whoever sits before it."""

    def say(self, text: str) -> None:
        """Tell something."""

    def ask(self, text: str) -> str:
        """Ask something and wait for the answer, a line."""

    def show(self, share: float) -> None:
        """How much of the present prompt is done."""


class TerminalTalk:
    """Speaks on stderr and listens to stdin."""

    def __init__(self, write: Callable[[str], object] | None = None) -> None:
        self._write = write or sys.stderr.write
        self._terminal = sys.stderr.isatty()

    def say(self, text: str) -> None:
        """A line of its own."""
        self._write(f"{text}\n")

    def ask(self, text: str) -> str:
        """The next line of stdin; InputError where it has ended."""
        self._write(text)
        sys.stderr.flush()
        answer = sys.stdin.readline()
        if not answer:
            raise InputError("The guide needs somebody at the keyboard: standard input has ended.")
        return answer

    def show(self, share: float) -> None:
        """A bar on a terminal."""
        if self._terminal:
            full = round(30 * share)
            self._write("\r" + "█" * full + "·" * (30 - full) + ("\n" if share >= 1 else ""))
