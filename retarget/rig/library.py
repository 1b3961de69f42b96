"""Where rigs are found by name: those that ship with the package, and those that the user has added.

The user's are in the folder `RETARGET_RIGS`, by default `retarget/rigs` below `XDG_DATA_HOME` (XDG Base Directory
Specification), one folder a rig. A name that ships cannot be taken.
"""

from __future__ import annotations

import os
from pathlib import Path

RIG_FILE = "rig.toml"


def shipped_rigs() -> dict[str, Path]:
    """Name to rig.toml of the rigs that ship."""
    import rigs

    return _rigs_in(Path(rigs.__file__).parent)


def user_rigs() -> dict[str, Path]:
    """Name to rig.toml of the rigs that the user has added."""
    return _rigs_in(user_folder())


def all_rigs() -> dict[str, Path]:
    """Both, those that ship first."""
    shipped = shipped_rigs()
    return shipped | {name: path for name, path in user_rigs().items() if name not in shipped}


def user_folder() -> Path:
    """The folder of the user's rigs, which may not be there yet."""
    if chosen := os.environ.get("RETARGET_RIGS"):
        return Path(chosen).expanduser()
    data = os.environ.get("XDG_DATA_HOME") or "~/.local/share"
    return Path(data).expanduser() / "retarget" / "rigs"


def _rigs_in(folder: Path) -> dict[str, Path]:
    return {path.parent.name: path for path in sorted(folder.glob(f"*/{RIG_FILE}"))}
