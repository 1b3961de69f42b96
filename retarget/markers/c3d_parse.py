"""Parses one C3D file with ezc3d, as a program of its own: ``python -P c3d_parse.py IN.c3d OUT.npz``.

The library can end its process on a damaged file (a segmentation fault); here that ends nobody else's. It imports
nothing of this package, so that it runs wherever its interpreter does. OUT.npz holds `points` (4, M, N) and `point`,
the parameters of the group POINT as JSON. A file that the library refuses ends it with status 1 and the reason on
stderr.
"""

from __future__ import annotations

import json
import sys

import ezc3d
import numpy as np


def main(source: str, target: str) -> None:
    """Parse `source` into `target`."""
    try:
        content = ezc3d.c3d(source)
    except (RuntimeError, OSError, ValueError) as error:
        sys.exit((str(error).splitlines() or ["it cannot be parsed"])[0])
    point = {
        key: _plain(entry["value"])
        for key, entry in content["parameters"]["POINT"].items()
        if entry and "value" in entry
    }
    np.savez(target, points=content["data"]["points"], point=json.dumps(point))


def _plain(value: object) -> list[object]:
    return list(np.asarray(value).ravel().tolist())


if __name__ == "__main__":
    main(*sys.argv[1:])
