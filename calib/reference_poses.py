"""Reference poses: the performer mimics named poses of the rig, so that it is known what each should look like.

A pose is one of the rig's shapes (`mouthSmileLeft`), several joined by "+", or an expression that the guide asks for
(`smile`). They come as a folder of takes, each named after its pose, in which the performer goes from the neutral into
the pose and holds it; or as one take with a list, a small TOML file::

    version = 1
    take = "poses.c3d"          # relative to the list

    [poses]                     # from, to [s]: while it is held
    browsUp = [2.0, 3.5]
    "mouthSmileLeft+mouthSmileRight" = [5.0, 6.5]
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from calib.expressions import BY_NAME
from calib.gains import predicted, solve_gains
from calib.recording import read_recording
from calib.rolling import rolling_mean
from retarget.errors import InputError
from retarget.toml_table import read_table

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from calib.matching import Motion
    from calib.pairs import Pairs
    from calib.recording import Recording
    from calib.rig_range import RigExtreme, RigRange
    from retarget.markers.layouts import Layout

    Array = NDArray[np.float64]

STRENGTHS = tuple(float(s) for s in np.logspace(-3, 1.5, 10))
"""[mm^2], of which one is chosen by leaving poses out."""
FEWEST_TO_CHOOSE = 4
"""With fewer poses the middle strength is taken."""
HUBER_MM = 2.0
LASTING_S = 0.1
NEAR_TOP = 0.9


@dataclass(frozen=True, slots=True, eq=False)
class MimickedPose:
    """A named pose and the recording in which it is held."""

    name: str
    recording: Recording
    start_s: float | None
    """From the first frame [s]; None where the hold is to be found."""
    end_s: float | None


def read_poses(where: str, layout: Layout | None) -> list[MimickedPose]:
    """The poses in a folder or a list; InputError where there is none, or the list has a mistake."""
    path = Path(where)
    if path.is_dir():
        takes = sorted(p for p in path.iterdir() if p.is_file() and not p.name.startswith("."))
        if not takes:
            raise InputError(f"There is no take in the folder {where}; name each after the pose that it shows.")
        return [MimickedPose(p.stem, read_recording(str(p), layout), None, None) for p in takes]
    if path.suffix.lower() != ".toml":
        raise InputError(f"Reference poses come as a folder of takes or as a .toml list, and {where} is neither.")
    return _read_list(path, layout)


def _read_list(path: Path, layout: Layout | None) -> list[MimickedPose]:
    file = read_table(path, "list of poses")
    file.only("version", "take", "poses")
    if file.number("version") != 1:
        raise file.wrong("version", "must be 1, the only version that this program reads")
    recording = read_recording(str(path.parent / file.string("take")), layout)
    spans = file.table("poses")
    if not spans.values:
        raise file.wrong("poses", "must name at least one pose")
    poses = []
    for name in spans.values:
        start_s, end_s = spans.array(name, (2,)).tolist()
        if not 0 <= start_s < end_s <= recording.seconds + 1e-6:
            raise spans.wrong(name, f"must be two times in order, within the {recording.seconds:.1f} s of the take")
        poses.append(MimickedPose(name, recording, start_s, end_s))
    return poses


def rig_pose(name: str, rig_range: RigRange) -> RigExtreme:
    """The rig in the named pose; InputError where it has no such shape."""
    shapes = BY_NAME[name].shapes if name in BY_NAME else tuple(part.strip() for part in name.split("+"))
    unknown = [shape for shape in shapes if shape not in rig_range.rig.shape_names and name not in BY_NAME]
    extreme = None if unknown else rig_range.extreme(name, dict.fromkeys(shapes, 1.0))
    if extreme is None:
        raise InputError(
            f"The rig {rig_range.rig.name!r} has no pose {name!r} that moves a site: name one of its shapes, several "
            f"joined by +, or one of {', '.join(BY_NAME)}."
        )
    return extreme


def held_frames(pose: MimickedPose, motion: Motion) -> NDArray[np.intp]:
    """The frames of the pose's recording in which it is held: those listed, or those farthest from the neutral."""
    if pose.start_s is not None and pose.end_s is not None:
        since = motion.times - motion.times[0]
        return np.flatnonzero((since >= pose.start_s) & (since <= pose.end_s))
    strength = np.sqrt(np.nansum(motion.whole**2, axis=(1, 2)))
    lasting = rolling_mean(strength, max(round(LASTING_S * pose.recording.rate_hz), 1))
    return np.flatnonzero(lasting >= NEAR_TOP * lasting.max())


def choose_strength(pairs: Pairs, graph: Array, default: float) -> tuple[float, list[float]]:
    """The strength whose K predicts left-out poses best, and the error of each [mm]; of equals the weakest.

    Equal is what lies within one standard error of the best, so that the poses speak for themselves where they can.
    """
    if len(pairs.names) < FEWEST_TO_CHOOSE:
        return STRENGTHS[len(STRENGTHS) // 2], []
    errors = np.array([_left_out(pairs, graph, default, strength) for strength in STRENGTHS])  # (L, P)
    means = errors.mean(axis=1)
    best = int(np.argmin(means))
    spread = (errors - errors[best]).std(axis=1) / np.sqrt(len(pairs.names))
    equal = means <= means[best] + spread
    return STRENGTHS[int(np.argmax(equal))], means.tolist()


def _left_out(pairs: Pairs, graph: Array, default: float, strength: float) -> list[float]:
    """Huber's mean error [mm] at each pose, by K of the others."""
    errors = []
    for pose in range(len(pairs.names)):
        K = solve_gains(pairs.without(pose), graph, default, strength).K
        off = 1e3 * np.linalg.norm(pairs.rig[pose] - predicted(K, pairs.seen[pose]), axis=-1)
        cost = np.where(off < HUBER_MM, off**2 / (2 * HUBER_MM), off - HUBER_MM / 2)
        errors.append(float((pairs.weights[pose] * cost).sum() / max(pairs.weights[pose].sum(), 1e-9)))
    return errors
