"""Pictures a second without a window, on this machine's own OpenGL: the human rig, moving.

The peer is pyrender used as its manual shows: `OffscreenRenderer`, lit, four samples a pixel, a new mesh a pose.
"""

from __future__ import annotations

import time
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from retarget.frames import Pose
from retarget.geometry import quat_from_axis_angle, quat_multiply
from retarget.rig.display.camera import camera_for
from retarget.rig.display.offscreen import Offscreen
from retarget.rig.display.platform import load_pyrender
from retarget.rig.display.view import View
from retarget.rig.load import load_rig
from retarget.rig.posing import rest_pose
from retarget.rig.skinning import Skin
from tests.benchmarks.report import Row, seconds_per_call

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from retarget.rig.model import Rig

AIMS_HZ = {(640, 480): 60, (1280, 720): 30}
PICTURES = 60


def rows() -> Iterator[Row]:
    """One row a size, a supersampling and a kind of work."""
    rig = load_rig("human")
    poses = moving_poses(rig)
    for (width, height), aim_hz in AIMS_HZ.items():
        peer_hz = 1 / seconds_per_call(plain_pyrender(rig, View(width, height), poses), repeat=8, warm_up=2)
        for supersampling in (1, 2):
            view = View(width, height, supersampling=supersampling)
            for kind, call in calls(rig, view, poses):
                hz, cpu_ms = rate_and_cpu(call)
                what = f"{width}x{height}, {supersampling**2} samples a pixel, {kind}"
                yield Row(what, hz, "pictures/s", "plain pyrender", peer_hz, f"at least {aim_hz}")
                yield Row(f"{what}: CPU", cpu_ms, "ms")


def calls(rig: Rig, view: View, poses: list[Pose]) -> Iterator[tuple[str, Callable[[], object]]]:
    """What is timed, by name; each call makes one picture."""
    skin = Skin(rig)
    with Offscreen(rig, view, skin) as offscreen:
        deformed = cycle([skin(pose) for pose in poses])
        yield "drawing", lambda: offscreen.draw(next(deformed))
        moving = cycle(poses)
        yield "skinning and drawing", lambda: offscreen.render(next(moving))


def rate_and_cpu(call: Callable[[], object]) -> tuple[float, float]:
    """Calls a second by the median call [Hz], and the processor time of one, all threads together [ms]."""
    start_s = time.process_time()
    median_s = seconds_per_call(call, PICTURES)
    return 1 / median_s, (time.process_time() - start_s) * 1e3 / (PICTURES + 5)


def moving_poses(rig: Rig, count: int = 16) -> list[Pose]:
    """Poses that move every joint a little and the jaw much, with ten blend shapes at work."""
    rng = np.random.default_rng(5)
    rest = rest_pose(rig)
    poses = []
    for i in range(count):
        rotations = rest.rotations.copy()
        if rig.jaw:
            turn = quat_from_axis_angle(rig.jaw.axis, rig.jaw.max_rad * i / count)
            rotations[rig.jaw.joint] = quat_multiply(rotations[rig.jaw.joint], turn)
        translations = rest.translations + rng.normal(scale=0.001, size=rest.translations.shape)
        weights = np.zeros_like(rest.weights)
        weights[rng.permutation(len(weights))[:10]] = 0.3
        poses.append(Pose(i, i / 60, i / 60, rest.T_world_head, translations, rotations, weights))
    return poses


def plain_pyrender(rig: Rig, view: View, poses: list[Pose]) -> Callable[[], object]:
    """One call draws one pose with pyrender alone."""
    pyrender = load_pyrender()
    skin, camera = Skin(rig), camera_for(rig, view)
    scene = pyrender.Scene(bg_color=[0.0, 1.0, 0.0, 1.0], ambient_light=[0.3, 0.3, 0.3])
    lens = pyrender.PerspectiveCamera(yfov=camera.yfov_rad, znear=camera.near, zfar=camera.far)
    scene.add(lens, pose=camera.T_rig_camera)
    scene.add(pyrender.DirectionalLight(intensity=3.0), pose=camera.T_rig_camera)
    renderer = pyrender.OffscreenRenderer(view.width, view.height)
    moving = cycle(poses)

    def draw() -> object:
        deformed = skin(next(moving))
        primitives = [
            pyrender.Primitive(positions, normals, indices=surface.triangles)
            for surface, positions, normals in zip(rig.surfaces, deformed.positions, deformed.normals, strict=True)
        ]
        node = scene.add(pyrender.Mesh(primitives))
        picture, _ = renderer.render(scene)
        scene.remove_node(node)
        return picture

    return draw
