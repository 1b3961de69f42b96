"""Reads a folder of OpenPose's JSON files, one a picture: the key points of everybody seen.

Units are what OpenPose was told to write (pixels, or parts of the picture); y points down, as in the files. A person
is the place in a file's list, as OpenPose does not follow anybody. Form: OpenPose output format, version 1.3.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MAX_FILE_BYTES = 4_000_000
MAX_FRAMES = 1_000_000
MAX_PERSONS = 100
_LAST_NUMBER = re.compile(r"(\d{1,15})\D*$")


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """The key points of a film."""

    source: Path
    frames: NDArray[np.intp]
    """(F,) number of each picture, rising from 0; a picture without a file is left out."""
    points: Array
    """(F, persons, K, 3): x, y, confidence; NaN where a person is not in a picture."""

    @property
    def persons(self) -> int:
        """The most people in one picture."""
        return int(self.points.shape[1])


def read_poses(folder: Path, points: int = 25) -> Recording:
    """Read every `*.json` of `folder`, in the order of their numbers. `points` is how many a person has.

    The number at the end of a name tells the picture's, so that a missing file leaves a gap; where names have none,
    files are taken in the order of their names. Raises InputError.
    """
    try:
        files = [path for path in folder.iterdir() if path.suffix.lower() == ".json"]
    except OSError as error:
        raise InputError(f"The folder {folder} cannot be read: {error.strerror}.") from None
    if not files:
        raise InputError(f"{folder} holds no *.json files: give the folder that OpenPose's --write_json filled.")
    files, frames = _in_order(files)
    people = [_people(path, points) for path in files]
    most = max(len(persons) for persons in people)
    if not most:
        raise InputError(f"Nobody was seen in any of the {len(files)} pictures of {folder}: check the film.")
    places = np.full((len(files), most, points, 3), np.nan)
    for at, persons in enumerate(people):
        places[at, : len(persons)] = np.reshape(persons, (len(persons), points, 3))
    return Recording(folder, frames, places)


def _in_order(files: list[Path]) -> tuple[list[Path], NDArray[np.intp]]:
    numbers = [int(found[1]) if (found := _LAST_NUMBER.search(path.stem)) else -1 for path in files]
    spread = max(numbers) - min(numbers)
    if min(numbers) < 0 or len(set(numbers)) < len(numbers) or spread > MAX_FRAMES:
        return sorted(files), np.arange(len(files))
    order = np.argsort(numbers)
    return [files[i] for i in order], np.array(numbers, np.intp)[order] - min(numbers)


def _people(path: Path, points: int) -> list[list[float]]:
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise InputError(f"{path} is too large for key points: a file may hold {MAX_FILE_BYTES} bytes.")
        document = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}.") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not JSON ({error}): run OpenPose again, or take the file away.") from None
    people = document.get("people") if isinstance(document, dict) else None
    if not isinstance(people, list) or len(people) > MAX_PERSONS:
        raise InputError(
            f'{path} has no list of up to {MAX_PERSONS} "people": it is not from OpenPose\'s --write_json.'
        )
    return [_keypoints(path, person, points) for person in people]


def _keypoints(path: Path, person: object, points: int) -> list[float]:
    values = person.get("pose_keypoints_2d") if isinstance(person, dict) else None
    if not isinstance(values, list) or len(values) != 3 * points:
        count = len(values) if isinstance(values, list) else "no"
        raise InputError(
            f'{path}: "pose_keypoints_2d" holds {count} numbers, and {3 * points} were expected, three for each of '
            f"{points} points: use the model that the 2D rig names."
        )
    if not all(isinstance(v, int | float) and not isinstance(v, bool) and abs(v) < 1e9 for v in values):
        raise InputError(f'{path}: "pose_keypoints_2d" holds something that is not a finite number.')
    return values
