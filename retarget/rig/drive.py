"""What moves the face: its joints, its blend shapes, or both, out of the same markers and the same calibration.

The joint mapping says where every site of the rig should be; what follows differs only in who takes it there.

- joints: the joints of the sites and the jaw, as `retarget.rig.joints` has it; the weights stay 0.
- shapes: the weights that bring the skin there (`retarget.rig.shapes`); site joints stay at rest.
- both: the shapes take what they can explain, the joints what is left, so that no motion is applied twice.

The mouth is opened once. The jaw's joint turns in "joints" and in "both"; `jawOpen` is out of the game then, and the
shapes see the sites with the jaw's turn taken back. In "shapes" `jawOpen` takes the whole way of the chin and the jaw's
joint rests, but for a rig without `jawOpen`, whose jaw turns. The head's own turn belongs to the joints always.

Smoothing is the last step, on weights, joints and jaw alike, so that what one leaves to the other lags by as much.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal, NamedTuple, get_args

import numpy as np

from retarget import geometry
from retarget.errors import InputError
from retarget.rig.joints import JointMapping
from retarget.rig.pose_smoother import PoseSmoother
from retarget.rig.secondary import SecondaryMotion
from retarget.rig.shapes import ShapeSolver
from retarget.rig.site_shapes import site_shapes
from retarget.rig.turns import parent_rest

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame, MarkerLayout, Pose
    from retarget.performer import Performer
    from retarget.rig.model import Rig
    from retarget.rig.pose_smoother import Smoothing

    Array = NDArray[np.float64]

DriveMode = Literal["joints", "shapes", "both"]
JAW_OPEN = "jawOpen"
LONGEST_STEP_BACK_S = 1.0
"""A clock that goes back farther has been set anew, as when a take begins again."""


class Drive:
    """Solves the frames of one layout for one performer on one rig, in order."""

    def __init__(
        self,
        rig: Rig,
        layout: MarkerLayout,
        performer: Performer,
        T_world_reference: Array | None = None,
        *,
        mode: DriveMode = "joints",
        smooth: Smoothing = "none",
    ) -> None:
        """As `JointMapping`; InputError too for a `mode` or a `smooth` that there is not, and for shapes on a rig that
        has none that the markers can tell.
        """
        if mode not in get_args(DriveMode):
            raise InputError(f"There is no way to drive a face called {mode!r}; there are: {_list(DriveMode)}.")
        if mode == "joints":
            _check_joints(rig)
        self._mapping = JointMapping(rig, layout, performer, T_world_reference)
        self._shapes = None if mode == "joints" else _ShapeDrive(rig, layout, self._mapping.sites, mode)
        self._smooth = PoseSmoother(rig, self._mapping.sites, smooth)
        self._trail = SecondaryMotion(rig, T_world_reference, performer.scale)
        self._time_s = -np.inf
        self.driven_shapes = self._shapes.solver.driven if self._shapes else ()
        """Blend shapes that the markers drive."""
        self.frozen_shapes = self._shapes.solver.frozen if self._shapes else ()
        """Blend shapes that stay at 0 because these markers cannot tell them."""

    def reset(self) -> None:
        """Forget all earlier frames."""
        if self._shapes:
            self._shapes.solver.reset()
        self._smooth.reset()
        self._trail.reset()
        self._time_s = -np.inf

    def __call__(self, frame: MarkerFrame, seen: NDArray[np.bool_] | None = None) -> Pose:
        """The pose of a stabilised frame, never NaN.

        `seen` (M,) says which markers the cameras saw; others may be filled in `frame`, which is good for joints, but
        weights ask only those seen. By default it is all that are not NaN.
        """
        if frame.time_s < self._time_s - LONGEST_STEP_BACK_S:
            self.reset()
        self._time_s = frame.time_s
        pose = self._mapping(frame)
        if self._shapes:
            finite = np.isfinite(frame.positions.sum(axis=1))
            pose = self._shapes(pose, finite if seen is None else finite & seen)
        return self._trail(self._smooth(pose))


class _ShapeDrive:
    """Gives the motion of a joint-driven pose to the shapes, as far as they go."""

    def __init__(self, rig: Rig, layout: MarkerLayout, sites: tuple[str, ...], mode: DriveMode) -> None:
        self._sites = _SiteJoints.of(rig, sites)
        self._markers = np.array([[site == name for site in layout.sites] for name in sites])
        self._joints_take_the_rest = mode == "both"
        jaw_turns = mode == "both" or JAW_OPEN not in rig.shape_names
        self._idle_jaw = None if rig.jaw is None or jaw_turns else rig.jaw.joint
        shapes = site_shapes(rig, sites)
        self._displacements = shapes.displacements
        self.solver = ShapeSolver(shapes, without=(JAW_OPEN,) if jaw_turns and rig.jaw else ())

    def __call__(self, pose: Pose, seen: NDArray[np.bool_]) -> Pose:
        """`pose` with weights, and joints that do what these leave."""
        moves = self._sites.moves(pose)
        rotations = pose.rotations.copy()
        target = moves
        if self._idle_jaw is not None:
            target = self._sites.with_jaw(moves, pose)
            rotations[self._idle_jaw] = self._sites.rig.joints.rotations[self._idle_jaw]
        missing = np.count_nonzero(self._markers & seen, axis=1) == 0
        weights = self.solver(np.where(missing[:, None], np.nan, target), pose.time_s)
        left = moves - self._displacements @ weights if self._joints_take_the_rest else np.zeros_like(moves)
        return replace(pose, translations=self._sites.moved(left), rotations=rotations, weights=weights)


class _SiteJoints(NamedTuple):
    """The joints of the sites, and how their translations add up to the displacements of the sites."""

    rig: Rig
    joints: NDArray[np.intp]
    """(S,)"""
    R_rig_parent: Array
    """(S, 3, 3) at rest."""
    carried: Array
    """(S, S) of 0 and 1: which of the joints are, or carry, which."""
    own: Array
    """(S, S): its inverse."""
    riders: NDArray[np.bool_]
    """(S,): those below the jaw."""
    rest: Array
    """(S, 3) [m], ``head``."""

    @classmethod
    def of(cls, rig: Rig, sites: tuple[str, ...]) -> _SiteJoints:
        joints = [rig.sites[name].joint for name in sites]
        carried = np.array([[float(k in _line_up(rig, j)) for k in joints] for j in joints])
        return cls(
            rig,
            np.array(joints, np.intp),
            np.array([parent_rest(rig.joints, j) for j in joints]),
            carried,
            np.linalg.inv(carried),
            np.array([rig.sites[name].rides_jaw for name in sites]),
            np.array([rig.sites[name].rest for name in sites]),
        )

    def moves(self, pose: Pose) -> Array:
        """(S, 3) [m], ``head``: the displacements of the sites in `pose`, before the jaw's turn."""
        shifts = pose.translations[self.joints] - self.rig.joints.translations[self.joints]
        moves: Array = self.carried @ (self.R_rig_parent @ shifts[:, :, None])[:, :, 0]
        return moves

    def moved(self, moves: Array) -> Array:
        """(J, 3) [m]: the joints' translations with the sites displaced by `moves` (S, 3), all else at rest."""
        translations = self.rig.joints.translations.copy()
        translations[self.joints] += (np.swapaxes(self.R_rig_parent, 1, 2) @ (self.own @ moves)[:, :, None])[:, :, 0]
        return translations

    def with_jaw(self, moves: Array, pose: Pose) -> Array:
        """(S, 3) [m], ``head``: the displacements with the jaw's turn in `pose` on top."""
        jaw = self.rig.jaw
        if jaw is None:
            return moves
        before, now = (geometry.matrix_from_quat(q[jaw.joint]) for q in (self.rig.joints.rotations, pose.rotations))
        R_rig_parent = parent_rest(self.rig.joints, jaw.joint)
        turn = R_rig_parent @ now @ before.T @ R_rig_parent.T
        lever = self.rest - jaw.pivot
        return np.where(self.riders[:, None], (lever + moves) @ turn.T - lever, moves)


def _line_up(rig: Rig, joint: int) -> list[int]:
    """The joint and all above it."""
    line = [joint]
    while rig.joints.parents[line[-1]] >= 0:
        line.append(int(rig.joints.parents[line[-1]]))
    return line


def _check_joints(rig: Rig) -> None:
    """InputError where all sites are mere places on the mesh, so that no joint would move it."""
    joints = [site.joint for site in rig.sites.values()]
    if joints and rig.shape_names and np.isnan(rig.joints.T_joint_mesh[joints]).all():
        raise InputError(f"The rig {rig.name!r} has no joints at its sites; drive its blend shapes: --drive shapes.")


def _list(choices: object) -> str:
    return ", ".join(get_args(choices))
