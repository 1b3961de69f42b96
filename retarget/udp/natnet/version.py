"""Which bitstream a datagram is written in, and what each version put into it.

A frame and a model definition carry no version of their own: the sender's answer to CONNECT says it once. Known are 2.5
to 4.3; the layouts follow the comments of the vendor's headers and its packet client, and where these disagree with
captured datagrams (see `BitstreamLayout.timestamp`), the datagrams.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

from retarget.errors import ProtocolError


class Bitstream(NamedTuple):
    """Version of the bitstream; compares like a pair."""

    major: int
    minor: int

    def __str__(self) -> str:
        return f"{self.major}.{self.minor}"


OLDEST = Bitstream(2, 5)
LATEST = Bitstream(4, 3)


def parse_bitstream(text: str) -> Bitstream:
    """Read "4.1" (or "4.1.0.0"); raise `ProtocolError` when it is not a version from 2.5 to 4.3."""
    major, _, rest = text.strip().partition(".")
    minor = rest.partition(".")[0]
    if not (major.isascii() and major.isdigit() and minor.isascii() and minor.isdigit() and len(text) < 32):
        raise ProtocolError(f"{text[:32]!r} is not a bitstream version; give one such as {LATEST}.")
    return require_known(Bitstream(int(major), int(minor)))


def require_known(version: Bitstream) -> Bitstream:
    """Return `version`; raise `ProtocolError` outside of 2.5 to 4.3."""
    if not OLDEST <= version <= LATEST:
        raise ProtocolError(
            f"Bitstream {version} is not known; {OLDEST} to {LATEST} are. Choose one of them in the sender's streaming "
            "settings."
        )
    return version


class TimestampForm(Enum):
    """How a frame's time stamp is written."""

    ABSENT = 0
    FLOAT32 = 4
    FLOAT64 = 8


class PrecisionForm(Enum):
    """Whether a frame ends with a precision time stamp."""

    ABSENT = 0
    EITHER = 1
    """4.0: sources disagree, the number of bytes left tells."""
    PRESENT = 2


@dataclass(frozen=True, slots=True)
class BitstreamLayout:
    """What one version writes and another does not."""

    version: Bitstream
    section_sizes: bool
    """From 4.1: every section of a frame and every description tells its size in bytes."""
    rigid_body_markers: bool
    """Before 3.0: markers travel with each rigid body of a frame; later they are in the model definition."""
    params: bool
    """From 2.6: flags of labelled markers, of rigid bodies and of the frame."""
    residual: bool
    """From 3.0: residual of each labelled marker."""
    assets: bool
    """From 4.1."""
    force_plates: bool
    """From 2.9."""
    devices: bool
    """From 2.11, which was published as 3.0."""
    software_latency: bool
    """Before 3.0."""
    timestamp: TimestampForm
    """Absent in 2.5 (real datagrams end right after the time code), float32 in 2.6, float64 from 2.7."""
    ticks: bool
    """From 3.0: high-resolution clock at mid-exposure, reception and transmission."""
    precision: PrecisionForm
    """From 4.1, perhaps from 4.0."""
    described_markers: bool
    """From 3.0: a rigid body's description lists its markers."""
    described_marker_names: bool
    """From 4.0: and their names."""
    described_rotation: bool
    """From 4.2: and the rigid body's rotation relative to its parent."""


@lru_cache(maxsize=64)
def layout_of(version: Bitstream) -> BitstreamLayout:
    """Return what `version` writes; raise `ProtocolError` outside of 2.5 to 4.3."""
    v = Bitstream(*require_known(version))
    return BitstreamLayout(
        version=v,
        section_sizes=v >= (4, 1),
        rigid_body_markers=v < (3, 0),
        params=v >= (2, 6),
        residual=v >= (3, 0),
        assets=v >= (4, 1),
        force_plates=v >= (2, 9),
        devices=v >= (2, 11),
        software_latency=v < (3, 0),
        timestamp=_timestamp_form(v),
        ticks=v >= (3, 0),
        precision=_precision_form(v),
        described_markers=v >= (3, 0),
        described_marker_names=v >= (4, 0),
        described_rotation=v >= (4, 2),
    )


def _timestamp_form(version: Bitstream) -> TimestampForm:
    if version < (2, 6):
        return TimestampForm.ABSENT
    return TimestampForm.FLOAT32 if version < (2, 7) else TimestampForm.FLOAT64


def _precision_form(version: Bitstream) -> PrecisionForm:
    if version < (4, 0):
        return PrecisionForm.ABSENT
    return PrecisionForm.EITHER if version < (4, 1) else PrecisionForm.PRESENT
