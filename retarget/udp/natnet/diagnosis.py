"""What was found at one step of a connection that is examined."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Outcome(Enum):
    """How a step went."""

    PASSED = "passed"
    WARNED = "warned"
    """The stream can be used, though not at its best."""
    FAILED = "failed"
    SKIPPED = "skipped"
    """There was nothing to examine, or a step before it failed."""


@dataclass(frozen=True, slots=True)
class Step:
    """One step, in words for a person."""

    name: str
    outcome: Outcome
    found: str
    """What was seen."""
    cause: str = ""
    """Why it is usually so; empty where all is well."""
    advice: str = ""
    """What to do about it."""
