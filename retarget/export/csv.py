"""Poses as a table: one row a frame, metres and unit quaternions xyzw.

Columns: ``frame, time_s``, the head in the capture volume ``head.tx .. head.qw``, then
``<joint>.tx,ty,tz,qx,qy,qz,qw`` relative to the parent joint for each joint of the rig, then one column a blend shape.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import OutputError
from retarget.geometry import quat_from_matrix

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType
    from typing import TextIO

    from retarget.frames import Pose

_FLUSH_S = 0.5
_PARTS = ("tx", "ty", "tz", "qx", "qy", "qz", "qw")


def header(joint_names: tuple[str, ...], shape_names: tuple[str, ...]) -> list[str]:
    """Names of the columns. A joint named ``head`` too is local to its parent, so the first seven columns are
    ``head.*`` of the world and the joint's are ``head.local.*``.
    """
    joints = ("head.local" if name == "head" else name for name in joint_names)
    return ["frame", "time_s", *_columns("head"), *(c for joint in joints for c in _columns(joint)), *shape_names]


class PosesCsv:
    """A sink: writes each pose as a row. Complete after every half second, whatever happens to the program."""

    def __init__(self, path: Path, joint_names: tuple[str, ...], shape_names: tuple[str, ...]) -> None:
        self._path = path
        self._header = header(joint_names, shape_names)
        self._format = ",".join(["%d", "%.9f", *["%.9g"] * (len(self._header) - 2)]) + "\n"
        self._file: TextIO | None = None
        self._flushed_s = 0.0

    def __enter__(self) -> PosesCsv:
        try:
            self._file = self._path.open("w", encoding="ascii", newline="")
            self._file.write(",".join(self._header) + "\n")
        except OSError as error:
            raise OutputError(f"{self._path} cannot be written ({error.strerror}): choose another place.") from None
        return self

    def __call__(self, pose: Pose) -> None:
        """Write one row."""
        if self._file is None:
            raise ValueError("the table is not open")
        try:
            self._file.write(self._format % row(pose))
            if time.monotonic() - self._flushed_s > _FLUSH_S:
                self._file.flush()
                self._flushed_s = time.monotonic()
        except OSError as error:
            raise OutputError(f"{self._path} cannot be written any further ({error.strerror}).") from None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            try:
                self._file.close()
            except OSError as failure:
                raise OutputError(f"{self._path} cannot be completed ({failure.strerror}).") from None


def row(pose: Pose) -> tuple[float, ...]:
    """The values of one row, in the order of `header`."""
    head = np.concatenate([pose.T_world_head[:3, 3], quat_from_matrix(pose.T_world_head[:3, :3])])
    joints = np.concatenate([pose.translations, pose.rotations], axis=1)
    values = np.concatenate([head, joints.ravel(), pose.weights])
    return (pose.number, pose.time_s, *values.tolist())


def _columns(name: str) -> list[str]:
    return [f"{name}.{part}" for part in _PARTS]
