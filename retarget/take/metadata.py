"""What a take says of itself, besides its datagrams."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

RECORD_NAME: Final = "retarget.take"
_VERSION_PREFIX: Final = "version."
_PLAIN: Final = ("source", "layout", "rig", "performer")


@dataclass(frozen=True, slots=True)
class TakeMetadata:
    """Where the datagrams came from and what they were recorded for; every text may be empty."""

    source: str = ""
    """URL or file name that the datagrams came from."""
    layout: str = ""
    """Name of the marker layout in use."""
    rig: str = ""
    """Name of the rig in use."""
    performer: str = ""
    """The performer's name."""
    versions: Mapping[str, str] = field(default_factory=dict)
    """Versions of whatever took part, by name: `retarget`, `natnet` (bitstream), `server` ..."""
    clock_offset_ns: int | None = None
    """Wall clock (Unix epoch) minus the monotonic clock of `Datagram.received_s` [ns]; None where it is not known."""

    def with_clock_offset(self) -> TakeMetadata:
        """The same, with this machine's present offset where none is known."""
        if self.clock_offset_ns is not None:
            return self
        return replace(self, clock_offset_ns=time.time_ns() - time.monotonic_ns())

    def as_text_map(self) -> dict[str, str]:
        """Keys and values as they stand in the file."""
        texts = {key: value for key in _PLAIN if (value := getattr(self, key))}
        texts |= {_VERSION_PREFIX + name: text for name, text in self.versions.items()}
        if self.clock_offset_ns is not None:
            texts["clock_offset_ns"] = str(self.clock_offset_ns)
        return texts


def from_text_map(texts: Mapping[str, str]) -> TakeMetadata:
    """The reverse of `TakeMetadata.as_text_map`; unknown keys are ignored, a clock offset that is no number is none."""
    versions = {k.removeprefix(_VERSION_PREFIX): v for k, v in texts.items() if k.startswith(_VERSION_PREFIX)}
    offset = texts.get("clock_offset_ns", "")
    digits = offset.removeprefix("-")
    known = digits.isascii() and digits.isdigit() and len(digits) <= 19
    plain = {key: texts.get(key, "") for key in _PLAIN}
    return TakeMetadata(**plain, versions=versions, clock_offset_ns=int(offset) if known else None)


def wall_ns(received_s: float, clock_offset_ns: int) -> int:
    """Unix time [ns] of a monotonic stamp, as it stands in files; never negative, at most 64 bits."""
    return min(max(0, round(received_s * 1e9) + clock_offset_ns), 0xFFFF_FFFF_FFFF_FFFF)
