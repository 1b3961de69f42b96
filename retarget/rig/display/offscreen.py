"""Pictures of a posed rig, drawn without a window.

Frame ``rig``; the pose's joints already hold the head's turn, and the camera stands still. Without a graphics card
(Mesa's llvmpipe) light is computed per vertex and pyrender draws flat, which is several times as fast as its lit
shader; with one, the card lights every pixel.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from retarget.errors import DisplayError
from retarget.rig.display.camera import camera_for
from retarget.rig.display.platform import Context
from retarget.rig.display.shading import EVENLY
from retarget.rig.display.view import View

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from numpy.typing import NDArray

    from retarget.frames import Pose
    from retarget.rig.model import Rig
    from retarget.rig.skinning import Deformed

CARD_SAMPLES = 4
"""Samples a pixel on a graphics card, where they cost next to nothing."""


class Offscreen:
    """Draws one rig. A context manager; one thread at a time may use it, not always the same."""

    def __init__(self, rig: Rig, view: View | None = None, skin: Callable[[Pose], Deformed] | None = None) -> None:
        """`skin` deforms the rig's surfaces; linear blend skinning where it is not given."""
        self._rig = rig
        self._view = view or View()
        self._skin = skin or _linear_skin(rig)
        self._context: Context | None = None
        self._surfaces: list[Any] = []
        self._scene: Any = None
        self._renderer: Any = None
        self._flags = 0
        self._R_rig_camera = np.eye(3, dtype=np.float32)

    def __enter__(self) -> Self:
        self._context = Context()
        self._context.acquire()
        try:
            self._build(self._context)
        except BaseException:
            self.close()
            raise
        self._context.release()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free everything on the card; a second call does nothing."""
        if self._context is None:
            return
        self._context.acquire()
        if self._renderer:
            self._renderer.delete()
        self._context.close()
        self._context = None

    @property
    def view(self) -> View:
        """How pictures are taken; a new value takes effect at the next picture, all but its shading."""
        return self._view

    @view.setter
    def view(self, view: View) -> None:
        self._view = view
        self._aim()

    def render(self, pose: Pose) -> NDArray[np.uint8]:
        """The picture (H, W, 3) of a pose, sRGB; raises as the skin does where the pose holds NaN."""
        return self.draw(self._skin(pose))

    def draw(self, deformed: Deformed) -> NDArray[np.uint8]:
        """The picture (H, W, 3) of surfaces that are deformed already, in ``rig``."""
        if self._context is None:
            raise DisplayError("The picture cannot be drawn: the display is closed, or was not yet opened by `with`.")
        self._context.acquire()
        try:
            for surface, positions, normals in zip(self._surfaces, deformed.positions, deformed.normals, strict=True):
                surface.update(positions, normals, self._R_rig_camera)
            pixels = self._renderer.render(self._scene, self._flags)
        finally:
            self._context.release()
        return _picture(pixels, self._view)

    def _build(self, context: Context) -> None:
        pyrender = import_module("pyrender")
        scenes = import_module("retarget.rig.display.scene")
        per_vertex = self._view.shading == "vertex" or (self._view.shading == "auto" and context.is_software)
        kind = scenes.VertexLitSurface if per_vertex else scenes.PixelLitSurface
        self._flags = pyrender.RenderFlags.OFFSCREEN | (pyrender.RenderFlags.FLAT if per_vertex else 0)
        self._surfaces = [kind(surface) for surface in self._rig.surfaces]
        self._scene = pyrender.Scene(ambient_light=EVENLY)
        self._scene.add(scenes.mesh_of(self._surfaces))
        camera = self._scene.add(pyrender.PerspectiveCamera(yfov=1.0))
        scenes.studio(camera, self._scene)
        samples = 0 if context.is_software else CARD_SAMPLES
        self._renderer = import_module("retarget.rig.display.framebuffer").Renderer(64, 64, samples)
        self._renderer.upload(self._scene)
        self._aim()

    def _aim(self) -> None:
        if self._renderer is None:
            return
        view, camera = self._view, camera_for(self._rig, self._view)
        node = self._scene.main_camera_node
        node.camera.yfov, node.camera.znear, node.camera.zfar = camera.yfov_rad, camera.near, camera.far
        self._scene.set_pose(node, camera.T_rig_camera)
        self._scene.bg_color = np.array([*view.background, 255]) / 255
        self._renderer.viewport_width = view.width * view.supersampling
        self._renderer.viewport_height = view.height * view.supersampling
        self._R_rig_camera = camera.T_rig_camera[:3, :3].astype(np.float32)


def _picture(pixels: NDArray[np.uint8], view: View) -> NDArray[np.uint8]:
    """(H, W, 3), upper row first, of RGBA pixels (n H, n W, 4), lower row first: each the mean of its samples."""
    cv2 = import_module("cv2")
    if view.supersampling > 1:
        pixels = cv2.resize(pixels, (view.width, view.height), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(cv2.flip(pixels, 0), cv2.COLOR_RGBA2RGB), np.uint8)


def _linear_skin(rig: Rig) -> Callable[[Pose], Deformed]:
    from retarget.rig.skinning import Skin

    return Skin(rig)
