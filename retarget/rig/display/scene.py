"""The rig's surfaces as pyrender draws them, refilled for every pose. Imported late: it needs pyrender on EGL.

pyrender's flat shader multiplies texture, base colour and vertex colour as they are and writes the product: all of it
is sRGB. So with light per vertex, everything but the texture goes into the vertex colour, encoded. Its lit shader takes
base and vertex colours as linear, decodes the texture and encodes the sum (with a plain power of 1/2.2).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pyrender
from OpenGL import GL

from retarget.rig.display import shading

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from retarget.rig.model import Material, Surface

    Floats = NDArray[np.float32]


class VertexLitSurface:
    """A surface whose light is computed here, per vertex, and drawn as it is."""

    def __init__(self, surface: Surface) -> None:
        material = surface.material
        texture = _texture(material)
        uv = _gl_uv(surface) if texture is not None else None
        self._roughness = material.roughness
        self._tint = _tint(surface)
        self._texel = _mean_texel(surface)
        self.primitive = pyrender.Primitive(
            surface.positions,
            texcoord_0=uv,
            color_0=self._tint,
            indices=surface.triangles,
            material=_material(material, texture, (1.0, 1.0, 1.0, 1.0)),
        )
        columns = [surface.positions, *([uv] if uv is not None else []), self._tint]
        self._vertices = np.ascontiguousarray(np.hstack(columns), np.float32)

    def update(self, positions: Floats, normals: Floats, R_rig_camera: Floats) -> None:
        """Move the surface, positions and unit normals (V, 3), and light it anew; the context must be current."""
        self._vertices[:, :3] = positions
        self._vertices[:, -4:-1] = self._colors(normals, R_rig_camera)
        _send(self.primitive, self._vertices)

    def _colors(self, normals: Floats, R_rig_camera: Floats) -> Floats:
        """(V, 3) sRGB to multiply the texture with, so that its mean texel comes out as light and gloss want it."""
        albedo = self._tint[:, :3] * shading.linear_from_srgb(self._texel)
        light = albedo * shading.diffuse(normals, R_rig_camera) + shading.gloss(normals, R_rig_camera, self._roughness)
        return shading.srgb_from_linear(light) / self._texel


class PixelLitSurface:
    """A surface that pyrender's shader lights, per pixel."""

    def __init__(self, surface: Surface) -> None:
        material = surface.material
        texture = _texture(material)
        uv = _gl_uv(surface) if texture is not None else None
        self.primitive = pyrender.Primitive(
            surface.positions,
            normals=surface.normals,
            texcoord_0=uv,
            color_0=surface.colors,
            indices=surface.triangles,
            material=_material(material, texture, material.base_color),
        )
        columns = [surface.positions, surface.normals, uv, surface.colors]
        self._vertices = np.ascontiguousarray(np.hstack([c for c in columns if c is not None]), np.float32)

    def update(self, positions: Floats, normals: Floats, R_rig_camera: Floats) -> None:  # noqa: ARG002 - the lights hang on the camera
        """Move the surface, positions and unit normals (V, 3); the context must be current."""
        self._vertices[:, :3] = positions
        self._vertices[:, 3:6] = normals
        _send(self.primitive, self._vertices)


def mesh_of(surfaces: Sequence[VertexLitSurface | PixelLitSurface]) -> Any:
    """One mesh, opaque surfaces first: pyrender draws the parts of a mesh in their order, but its nodes in none."""
    primitives = [surface.primitive for surface in surfaces]
    return pyrender.Mesh(sorted(primitives, key=lambda p: p.material.alphaMode == "BLEND"))


def studio(camera_node: Any, scene: Any) -> None:
    """Hang the lights of `shading` on the camera, for pyrender's own shader."""
    for direction, color in zip(shading.LIGHT_DIRECTIONS, shading.LIGHT_COLORS, strict=True):
        strength = float(color.max())
        light = pyrender.DirectionalLight(color=color / strength, intensity=strength * np.pi)
        scene.add(light, pose=_looking_from(direction), parent_node=camera_node)


def _send(primitive: Any, vertices: Floats) -> None:
    GL.glBindBuffer(GL.GL_ARRAY_BUFFER, primitive._buffers[0])
    GL.glBufferSubData(GL.GL_ARRAY_BUFFER, 0, vertices.nbytes, vertices)


def _looking_from(direction: Floats) -> NDArray[np.float64]:
    """(4, 4) of a node whose +Z is `direction` (3,)."""
    z = direction.astype(float)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return pose


def _material(material: Material, texture: Any, base_color: tuple[float, float, float, float]) -> Any:
    return pyrender.MetallicRoughnessMaterial(
        baseColorFactor=base_color,
        baseColorTexture=texture,
        metallicFactor=material.metallic,
        roughnessFactor=material.roughness,
        alphaMode="OPAQUE" if material.alpha_mode == "OPAQUE" else "BLEND",
        doubleSided=material.double_sided,
    )


def _texture(material: Material) -> Any:
    if material.texture is None:
        return None
    pixels = material.texture
    if material.alpha_mode == "MASK":  # pyrender's shaders cannot discard: the mask becomes an alpha of 0 or 1
        pixels = np.dstack([pixels[..., :3], np.where(pixels[..., 3] >= 128, 255, 0).astype(np.uint8)])
    return pyrender.Texture(source=pixels, source_channels="RGBA")


def _gl_uv(surface: Surface) -> Floats | None:
    """Since pyrender turns pictures upside down on their way to OpenGL, whose v points up, so must be these."""
    if surface.uv is None:
        return None
    return np.stack([surface.uv[:, 0], 1 - surface.uv[:, 1]], axis=1).astype(np.float32)


def _tint(surface: Surface) -> Floats:
    """(V, 4) linear: the base colour times the vertices' own."""
    base = np.asarray(surface.material.base_color, np.float32)
    colors = np.ones((len(surface.positions), 4), np.float32) if surface.colors is None else surface.colors
    return np.asarray(colors * base, np.float32)


def _mean_texel(surface: Surface) -> Floats:
    """(3,) sRGB: the texture's mean over the vertices, kept off zero for the division; white without a texture."""
    texture, uv = surface.material.texture, surface.uv
    if texture is None or uv is None:
        return np.ones(3, np.float32)
    height, width = texture.shape[:2]
    columns, rows = (np.floor(uv * [width, height]).astype(int) % [width, height]).T
    mean = texture[rows, columns, :3].mean(axis=0) / 255
    return np.asarray(np.maximum(mean, 0.1), np.float32)
