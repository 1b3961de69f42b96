"""`make demo-camera`: a talking head through camera, landmarks, UDP and face, to a film of both side by side.

The clip is looked at as a camera would be, in real time; its landmarks go over loopback UDP as datagrams; what comes
out of the socket drives the face. The clip and the models are fetched once, see `retarget.camera.models`.
"""

from __future__ import annotations

import itertools
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np

from retarget.camera import models
from retarget.camera.source import CameraSource
from retarget.rig.display.offscreen import Offscreen
from retarget.rig.display.view import View
from retarget.rig.load import load_rig
from retarget.session import Session, poses
from retarget.sources import Paced
from retarget.udp.landmark_sink import LandmarkSink
from retarget.udp.landmark_source import LandmarkSource
from tests.camera.clips import CARPHONE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame, Pose

    Image = NDArray[np.uint8]

ROOT = Path(__file__).parents[1]
FILM, PICTURE = ROOT / "demo-camera.mp4", ROOT / "demo-camera.png"
HEIGHT = 480
MOMENTS_S = (0.5, 1.5, 2.0, 3.75)
BACKGROUND = (58, 66, 74)
MODEL = "face_mesh478"
"""Those it needs all come in the same package."""


class Shown(NamedTuple):
    """What the camera saw and where it saw the face."""

    picture: Image
    points: NDArray[np.float64]


def main() -> int:
    """Fetch, track, send, receive, solve, draw; 0 if every picture has its face."""
    models.fetch(MODEL, print)
    if models.state(CARPHONE) != "ready":
        models.fetch_cards((CARPHONE,), print)
    print(f"Tracking {CARPHONE.path.name} in real time, over loopback UDP ...", flush=True)
    shown, frames, rate_hz = track(CARPHONE.path)
    solved = list(poses(frames, Session(load_rig("human"))))
    print(f"{len(shown)} pictures, {len(frames)} frames received, {len(solved)} poses; drawing ...", flush=True)
    draw(shown, solved, rate_hz)
    print(f"Look at {FILM.name} and {PICTURE.name}.")
    return 0 if len(solved) == len(shown) else 1


def track(clip: Path) -> tuple[list[Shown], list[MarkerFrame], float]:
    """What was seen, what came out of the socket, and pictures a second."""
    shown: list[Shown] = []
    with LandmarkSource("udp://127.0.0.1:0") as source, CameraSource(str(clip)) as camera:
        sender = threading.Thread(target=send, args=(camera, source.address[1], shown), name="camera")
        sender.start()
        frames = list(itertools.islice(source, camera.frame_count))
        sender.join()
        return shown, frames, camera.rate_hz or 30.0


def send(camera: CameraSource, port: int, shown: list[Shown]) -> None:
    """The camera's half of the service."""
    with LandmarkSink(f"udp://127.0.0.1:{port}") as sink:
        for frame in Paced(camera):
            sink(frame, camera.confidence)
            if camera.seen is not None and camera.seen.landmarks is not None:
                shown.append(Shown(camera.seen.picture.image, camera.seen.landmarks.points))


def draw(shown: list[Shown], solved: list[Pose], rate_hz: float) -> None:
    """The film, and a picture of its moments."""
    moments = [round(time_s * rate_hz) for time_s in MOMENTS_S]
    kept = []
    writer: cv2.VideoWriter | None = None
    for number, both in enumerate(side_by_side(shown, solved)):
        if writer is None:
            size = (both.shape[1], both.shape[0])
            writer = cv2.VideoWriter(str(FILM), cv2.VideoWriter.fourcc(*"mp4v"), rate_hz, size)
        writer.write(both)
        if number in moments:
            kept.append(both)
    if writer is not None:
        writer.release()
    cv2.imwrite(str(PICTURE), np.concatenate(kept, axis=0))


def side_by_side(shown: list[Shown], solved: list[Pose]) -> Iterator[Image]:
    """(H, W, 3) BGR: the picture with its landmarks, and the face."""
    view = View(width=HEIGHT, height=HEIGHT, background=BACKGROUND, supersampling=2)
    with Offscreen(load_rig("human"), view) as display:
        for seen, pose in zip(shown, solved, strict=True):
            face = np.asarray(display.render(pose), np.uint8)[..., ::-1]
            yield np.concatenate([with_points(seen), face], axis=1)


def with_points(seen: Shown) -> Image:
    """The picture enlarged, every landmark a dot."""
    scale = HEIGHT / seen.picture.shape[0]
    width = 2 * round(seen.picture.shape[1] * scale / 2)
    large = cv2.resize(seen.picture, (width, HEIGHT), interpolation=cv2.INTER_CUBIC)
    for x, y in np.rint(seen.points[:, :2] * scale).astype(int).tolist():
        cv2.circle(large, (x, y), 1, (120, 220, 120), -1, cv2.LINE_AA)
    return np.asarray(large, np.uint8)


if __name__ == "__main__":
    sys.exit(main())
