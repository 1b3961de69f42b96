"""What a calibration is made of: still faces, ranges of motion, and perhaps reference poses.

Every range of motion is laid into the ``head`` of the one neutral that becomes the performer's. A take that brings a
neutral of its own, because the markers were stuck on anew or a session went by, is measured from that one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.rigid_fits import LEAST, rigid_fits
from calib.stabilised import stabilised
from retarget import geometry
from retarget.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from calib.neutral import StillFace
    from calib.recording import Recording
    from calib.reference_poses import MimickedPose

    Array = NDArray[np.float64]

LEAST_S = 1.0
PAUSE_S = 10.0
"""Between takes, when they are laid one after the other [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class RangeTake:
    """A take in which the performer goes through expressions."""

    recording: Recording
    neutral: StillFace | None = None
    """Its own still face; None where the performer's holds."""
    prompts: tuple[str, ...] = ()
    """What was asked for in each frame, or nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """Everything that was recorded."""

    neutral: StillFace
    takes: tuple[RangeTake, ...]
    poses: tuple[MimickedPose, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class LaidOut:
    """All takes, one after the other, in ``head``, as if their neutral were one."""

    times: Array
    """(T,) [s]"""
    positions: Array
    """(T, M, 3) [m]"""
    prompts: tuple[str, ...]
    residual_m: float
    missing: Array
    """(M,)"""
    spikes: Array
    """(M,)"""


def lay_out(takes: tuple[RangeTake, ...], neutral: Array) -> LaidOut:
    """All `takes` in the ``head`` of `neutral` (M, 3) [m]; InputError where there is none, or one is too short."""
    if not takes:
        raise InputError("There is no range of motion to calibrate with; give at least one take with --rom.")
    parts = []
    times: list[Array] = []
    for take in takes:
        recording = take.recording
        if recording.seconds < LEAST_S:
            raise InputError(
                f"{recording.name} is too short for a range of motion: it lasts {recording.seconds:.2f} s, and the "
                "expressions take about half a minute."
            )
        own = neutral if take.neutral is None else own_neutral(take, neutral)
        part = stabilised(recording, own[list(recording.layout.head)])
        shift = np.where(np.isfinite(own), neutral - own, 0.0)
        parts.append((part, part.positions + shift))
        start = times[-1][-1] + PAUSE_S if times else 0.0
        times.append(start + recording.times - recording.times[0])
    lengths = np.array([len(t) for t in times], float)
    share = lengths / lengths.sum()
    return LaidOut(
        times=np.concatenate(times),
        positions=np.concatenate([positions for _, positions in parts]),
        prompts=_prompts(takes),
        residual_m=float(np.sqrt(share @ np.array([part.residual_m for part, _ in parts]) ** 2)),
        missing=share @ np.array([part.missing for part, _ in parts]),
        spikes=share @ np.array([part.spikes for part, _ in parts]),
    )


def own_neutral(take: RangeTake, neutral: Array) -> Array:
    """(M, 3) [m]: the take's own still face, laid by its head markers onto the performer's `neutral`."""
    if take.neutral is None:
        return neutral
    head = list(take.recording.layout.head)
    own = take.neutral.positions
    both = np.isfinite(own[head]).all(axis=1) & np.isfinite(neutral[head]).all(axis=1)
    if both.sum() < LEAST:
        raise InputError(
            f"Head markers are missing in {take.recording.name}: its neutral shares {int(both.sum())} of them with the "
            f"performer's, and {LEAST} are needed."
        )
    rows = np.array(head)[both]
    T = rigid_fits(own[rows], neutral[rows][None], np.ones((1, len(rows))))[0]
    return geometry.apply(T, own)


def _prompts(takes: tuple[RangeTake, ...]) -> tuple[str, ...]:
    if not any(take.prompts for take in takes):
        return ()
    return tuple(prompt for take in takes for prompt in (take.prompts or ("",) * len(take.recording.times)))
