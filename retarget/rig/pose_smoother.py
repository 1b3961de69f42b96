"""Smooths poses over time: weights, what the sites' joints move, and the jaw; the head is left alone.

All are brought to a range of about 1 first, so that one set of parameters serves all (a site goes some 10 mm, a jaw
turns by half a radian). "one-euro" keeps fast motion in time; "pd" is the mass of OpenVHead in true time, stiller and
slower, with its blink trick on the shapes that shut the eyes: an eye shut by two thirds is shut.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from retarget.errors import InputError
from retarget.filters import BlinkTrick, OneEuro, PdGains, PdMass
from retarget.geometry import align_hemisphere

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.filters import Filter
    from retarget.frames import Pose
    from retarget.rig.model import Rig

    Array = NDArray[np.float64]

Smoothing = Literal["pd", "one-euro", "none"]
MOVE_M = 0.01
"""A large motion of a site."""
JAW_PART = 0.25
"""A large sine of half the jaw's turn."""
EYES = ("eyeBlinkLeft", "eyeBlinkRight")
OPEN = 0.2
"""OpenVHead's measure of an open eye, to which its numbers for blinks belong."""
SHUT_BELOW, SHUT = 0.07 / OPEN, 0.01 / OPEN
PD_GAINS = PdGains(mass=1.0, alpha=0.7)


class PoseSmoother:
    """A stage: poses of one rig in order, each smoothed by those before."""

    def __init__(self, rig: Rig, sites: tuple[str, ...], smoothing: Smoothing) -> None:
        """For the joints of these `sites`; InputError for a `smoothing` that there is not."""
        self._joints = np.array([rig.sites[name].joint for name in sites], np.intp)
        self._jaw = rig.jaw.joint if rig.jaw else None
        self._rest = rig.joints
        self._eyes = np.array([name in EYES for name in rig.shape_names], bool)
        self._filter = self._make(smoothing)

    def _make(self, smoothing: Smoothing) -> Filter | None:
        if smoothing not in get_args(Smoothing):
            raise InputError(
                f"There is no smoothing called {smoothing!r}; there are: {', '.join(get_args(Smoothing))}."
            )
        if smoothing == "one-euro":
            return OneEuro()
        if smoothing == "pd":
            rest = np.full(3 * len(self._joints) + 4 * (self._jaw is not None), -np.inf)
            thresholds = np.concatenate([np.where(self._eyes, SHUT_BELOW, -np.inf), rest])
            floors = np.concatenate([np.zeros(len(self._eyes)), rest])
            return BlinkTrick(PdMass(PD_GAINS, floors), thresholds, SHUT)
        return None

    def reset(self) -> None:
        """Forget all earlier poses."""
        if self._filter:
            self._filter.reset()

    def __call__(self, pose: Pose) -> Pose:
        """The smoothed pose, in arrays of its own."""
        if self._filter is None:
            return pose
        smooth = self._filter(self._signals(pose), pose.time_s)
        B, S = len(self._eyes), len(self._joints)
        weights = np.where(self._eyes, 1 - smooth[:B], smooth[:B]).clip(0.0, 1.0)
        translations, rotations = pose.translations.copy(), pose.rotations.copy()
        shifts = MOVE_M * smooth[B : B + 3 * S].reshape(S, 3)
        translations[self._joints] = self._rest.translations[self._joints] + shifts
        if self._jaw is not None:
            turn = smooth[B + 3 * S :]
            rotations[self._jaw] = turn / np.linalg.norm(turn)
        return replace(pose, weights=weights, translations=translations, rotations=rotations)

    def _signals(self, pose: Pose) -> Array:
        """(B + 3 S + 4,) in ranges of about 1: weights, or openness for eyes; shifts of the joints; the jaw's turn."""
        weights = np.where(self._eyes, 1 - pose.weights, pose.weights)
        shifts = (pose.translations - self._rest.translations)[self._joints].ravel() / MOVE_M
        if self._jaw is None:
            return np.concatenate([weights, shifts])
        turn = align_hemisphere(pose.rotations[self._jaw], self._rest.rotations[self._jaw]) / JAW_PART
        return np.concatenate([weights, shifts, turn])
