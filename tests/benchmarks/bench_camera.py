"""Pictures to landmarks, weights, metres and datagrams: time a picture, and distance to what mediapipe itself answers.

Looks at the carphone clip, 176 x 144 pixels; without the models or the clip (`make demo-camera` fetches both) only what
needs neither is measured. The oracles are answers of mediapipe 0.10.21 (video mode) and 1.2.2 (picture mode).
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from retarget.camera import models
from retarget.camera.blendshape_net import BlendshapeNet
from retarget.camera.canonical import load_canonical_face
from retarget.camera.face_mesh import FaceMesh
from retarget.camera.files import FilmPictures
from retarget.camera.head_pose import OPENVHEAD_MODEL, OPENVHEAD_POINTS, HeadPoseTracker, openvhead_pose
from retarget.camera.measures import mesh_measures
from retarget.camera.metric import MeshDepth
from retarget.camera.openvhead import OpenVHeadChain
from retarget.udp.landmarks import PointsMessage, decode, encode_points
from tests.benchmarks.report import Row, seconds_per_call
from tests.camera.clips import CARPHONE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from retarget.camera.landmarks import Landmarks

    Image = NDArray[np.uint8]

ORACLE = Path(__file__).parents[2] / "../shared/data/oracles/mediapipe_carphone.npz"
SIZE = (176, 144)
T = TypeVar("T")


def rows() -> Iterator[Row]:
    """Time of each step, then agreement."""
    yield from _poses()
    yield from _datagrams()
    if models.state(CARPHONE) == "ready" and all(state == "ready" for _, state in models.available()):
        with FilmPictures(CARPHONE.path) as film:
            pictures = [picture.image for picture in film]
        yield from _times(pictures)
        if ORACLE.exists():
            yield from _agreement(pictures)


def _poses() -> Iterator[Row]:
    rng = np.random.default_rng(0)
    points = np.zeros((68, 2))
    points[list(OPENVHEAD_POINTS)] = OPENVHEAD_MODEL[:, :2] * [0.2, -0.2] + [264, 216]
    track, chain = HeadPoseTracker(OPENVHEAD_MODEL, (528, 432)), OpenVHeadChain((528, 432))
    noisy = [points + rng.normal(size=points.shape) * 0.5 for _ in range(50)]
    six = [each[list(OPENVHEAD_POINTS)] for each in noisy]
    yield Row(
        "head pose of 6 points, from the last one on",
        _micros(_cycling(track, six)),
        "µs",
        "OpenVHead's EPnP",
        _micros(_cycling(lambda each: openvhead_pose(each, (528, 432)), noisy)),
    )
    yield Row("OpenVHead's whole chain", _micros(_cycling(chain, noisy)), "µs")


def _datagrams() -> Iterator[Row]:
    message = PointsMessage(1, 2, 3, 4.0, 1.0, np.ones((478, 3)))
    payload = encode_points(message)
    yield Row("write a datagram of 478 points", _micros(lambda: encode_points(message)), "µs")
    yield Row("read it", _micros(lambda: decode(payload)), "µs")


def _times(pictures: list[Image]) -> Iterator[Row]:
    yield Row("468 points, following", _millis(_cycling(FaceMesh(468), pictures)), "ms", aim="< 10")
    yield Row("478 points, following", _millis(_cycling(FaceMesh(478), pictures)), "ms")
    yield Row(
        "478 points, searched in every picture", _millis(_cycling(FaceMesh(478, "every picture"), pictures)), "ms"
    )
    faces = _landmarks(FaceMesh(478), pictures)
    metres = MeshDepth(load_canonical_face(), SIZE)
    yield Row("weights of 51 expressions", _millis(_cycling(BlendshapeNet(), faces)), "ms")
    yield Row("metres of 478 points", _micros(_cycling(metres, faces)), "µs")
    yield Row("ten measures of the mesh", _micros(_cycling(mesh_measures, [metres(face) for face in faces])), "µs")


def _agreement(pictures: list[Image]) -> Iterator[Row]:
    with np.load(ORACLE) as oracle:
        of478, of468, weights = oracle["landmarks478_px"], oracle["mesh468_px"], oracle["blendshapes"][:, 1:]
    searched = _landmarks(FaceMesh(478, "every picture"), pictures)
    followed = _landmarks(FaceMesh(468), pictures)
    net = BlendshapeNet()
    aim = "< 1"
    yield Row("478 points to mediapipe 1.2.2, of the eye distance", _percent(searched, of478), "%", aim=aim)
    yield Row("468 points to mediapipe 0.10.21, of the eye distance", _percent(followed, of468), "%", aim=aim)
    ours = np.array([net(face) for face in searched])
    yield Row("51 weights to mediapipe 1.2.2, mean", float(np.abs(ours - weights).mean()), "", aim="< 0.02")


def _landmarks(detect: FaceMesh, pictures: list[Image]) -> list[Landmarks]:
    return [found for picture in pictures if (found := detect(picture)) is not None]


def _percent(found: list[Landmarks], oracle: NDArray[np.float32]) -> float:
    ours = np.array([face.points[: oracle.shape[1], :2] for face in found])
    eyes = np.linalg.norm(oracle[:, 33, :2] - oracle[:, 263, :2], axis=1).mean()
    return float(100 * np.linalg.norm(ours - oracle[..., :2], axis=2).mean() / eyes)


def _cycling(call: Callable[[T], object], values: list[T]) -> Callable[[], object]:
    following = itertools.cycle(values)
    return lambda: call(next(following))


def _micros(call: Callable[[], object]) -> float:
    return 1e6 * seconds_per_call(call, repeat=400)


def _millis(call: Callable[[], object]) -> float:
    return 1e3 * seconds_per_call(call, repeat=110)
