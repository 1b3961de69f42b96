"""`make demo`: a take served over loopback UDP as NatNet 4.1, the whole service on it, a film and a picture."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
TAKE = ROOT / "takes" / "demo.c3d"
FILM, PICTURE = ROOT / "demo.mp4", ROOT / "demo.png"
MOMENTS_S = {"neutral": 0.5, "brows": 1.7, "smile": 3.4, "wide open": 8.7}


def main() -> int:
    """Play the take to the service, then draw its four moments; the exit status of the service."""
    print(f"Serving {TAKE.relative_to(ROOT)} over loopback UDP and solving it as it comes (10 s) ...", flush=True)
    server = subprocess.Popen(
        [sys.executable, "-m", "retarget", "replay", str(TAKE), "--port", "0", "--bitstream", "4.1"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        address = served_address(server)
        service = subprocess.run([sys.executable, "-m", "retarget", "run", address, "--to", str(FILM)], check=False)
    finally:
        server.terminate()
        server.communicate()
    if service.returncode == 0:
        draw_moments()
        print(f"Look at {FILM.name} and {PICTURE.name}.")
    return service.returncode


def served_address(server: subprocess.Popen[str]) -> str:
    """What the server says that it serves."""
    line = server.stderr.readline() if server.stderr else ""
    found = re.search(r"natnet://\S+", line)
    if not found:
        raise SystemExit(f"The server did not start: {line}{server.communicate()[1]}")
    return found[0]


def draw_moments() -> None:
    """The picture: the take's four moments side by side, solved straight from the file."""
    from PIL import Image

    from retarget.markers.c3d import read_c3d
    from retarget.rig.display.offscreen import Offscreen
    from retarget.rig.display.view import View
    from retarget.rig.load import load_rig
    from retarget.session import Session, poses

    rig, clip = load_rig("human"), read_c3d(TAKE)
    solution = list(poses(clip, Session(rig)))
    numbers = [round(t * clip.rate_hz) for t in MOMENTS_S.values()]
    with Offscreen(rig, View(width=400, height=480, background=(58, 66, 74), supersampling=3)) as display:
        pictures = [display.render(solution[number]) for number in numbers]
    Image.fromarray(np.concatenate(pictures, axis=1)).save(PICTURE)


if __name__ == "__main__":
    sys.exit(main())
