"""Tells, while a performer waits, whether an expression was seen, against the rig's own at the performer's size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib.face import FaceSites, face_sites, site_moves
from calib.matching import Match, Motion, find_matches
from calib.material import RangeTake, lay_out
from calib.rig_range import RigRange
from retarget.rig.fit import performer_from_neutral
from retarget.rig.jaw import signed_angle

if TYPE_CHECKING:
    from calib.neutral import StillFace
    from calib.recording import Recording
    from calib.rig_range import RigExtreme
    from retarget.performer import Performer
    from retarget.rig.model import Rig

ENOUGH = 0.5
"""Part of the rig's own strength from which on an expression is worth keeping."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenNeutral:
    """A still face and the recording that it comes from."""

    still: StillFace
    recording: Recording


class Eye:
    """Tells whether an expression was seen, against the rig's own at the performer's size."""

    def __init__(self, rig: Rig, neutral: SeenNeutral) -> None:
        layout = neutral.recording.layout
        self._performer: Performer = performer_from_neutral(layout, neutral.still.positions, rig)[0]
        self._face: FaceSites = face_sites(layout, self._performer.neutral, rig)
        self._extremes: list[RigExtreme] = RigRange(rig, self._face.names).extremes()
        self.names = [extreme.name for extreme in self._extremes]
        """The expressions that the rig can show at these sites."""

    def sees(self, recording: Recording, name: str) -> tuple[bool, str]:
        """Whether the expression is there, strongly enough, and a line about it."""
        motion = self._motion(recording, name)
        matches = find_matches(motion, self._extremes, self._face.names, self._performer.scale, self._lever())
        mine = [match for match in matches if match.name == name]
        extreme = next(extreme for extreme in self._extremes if extreme.name == name)
        lines = [self._line(match, extreme) for match in mine if match.exercised]
        if not lines:
            return False, f"Not seen: {name}, {self._expected(extreme)} expected."
        weak = max(match.share for match in mine) < ENOUGH
        return not weak, ("Hardly seen" if weak else "Seen") + f": {'; '.join(lines)}."

    def _line(self, match: Match, extreme: RigExtreme) -> str:
        distances = 1e3 * np.linalg.norm(np.nan_to_num(match.moves), axis=1)
        site = int(np.argmax(np.linalg.norm(extreme.moves, axis=1) * (distances > 0)))
        expected = 1e3 * float(np.linalg.norm(extreme.moves[site])) / self._performer.scale
        side = f" {match.side.lower()}" if match.side else ""
        turn = f", the jaw {np.degrees(match.turn_rad):.0f}°" if extreme.jaw_rad else ""
        name = self._face.names[site]
        return f"{match.name}{side}, {name} {distances[site]:.1f} mm of {expected:.1f} expected{turn}"

    def _expected(self, extreme: RigExtreme) -> str:
        distances = 1e3 * np.linalg.norm(extreme.moves, axis=1) / self._performer.scale
        site = int(np.argmax(distances))
        return f"{distances[site]:.1f} mm at {self._face.names[site]}"

    def _motion(self, recording: Recording, name: str) -> Motion:
        neutral = self._performer.neutral
        laid = lay_out((RangeTake(recording, None, (name,) * len(recording.times)),), neutral)
        jaw, chin = self._performer.jaw, self._face.markers[self._face.chin]
        axis, pivot = (jaw.axis, jaw.pivot) if jaw else (np.array([1.0, 0.0, 0.0]), np.zeros(3))
        turn = np.zeros(len(laid.times))
        if jaw and len(chin):
            turn = np.maximum(signed_angle(neutral[chin] - pivot, laid.positions[:, chin] - pivot, axis), 0.0)
        moves = site_moves(self._face, neutral, laid.positions, turn, axis, pivot)
        whole = site_moves(self._face, neutral, laid.positions, None, axis, pivot)
        return Motion(laid.times, moves, whole, turn, laid.prompts)

    def _lever(self) -> float:
        jaw, chin = self._performer.jaw, self._face.markers[self._face.chin]
        if jaw is None or not len(chin):
            return 0.0
        return float(np.linalg.norm(self._performer.neutral[chin].mean(axis=0) - jaw.pivot))
