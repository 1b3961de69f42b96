"""Colours and pictures of an independent writer, and damaged ones."""

from __future__ import annotations

import io
import zlib
from typing import TYPE_CHECKING

import numpy as np
import pygltflib as g
import pytest
from PIL import Image

from retarget.errors import InputError
from tests.rig.glb_files import GlbFile, read_mesh, two_joint_file

if TYPE_CHECKING:
    from pathlib import Path


def picture(kind: str, size: tuple[int, int] = (2, 3)) -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", size, (200, 100, 50)).save(stream, kind)
    return stream.getvalue()


def textured_file(data: bytes) -> GlbFile:
    file = two_joint_file()
    uv = file.accessor(np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32))
    colors = file.accessor(np.array([[255, 0, 51]] * 4, np.uint8), normalized=True)
    primitive = file.gltf.meshes[0].primitives[0]
    primitive.attributes.TEXCOORD_1, primitive.attributes.COLOR_0, primitive.material = uv, colors, 0
    look = g.PbrMetallicRoughness(baseColorFactor=[0.5, 0.6, 0.7, 0.8], roughnessFactor=0.3, metallicFactor=0.1)
    look.baseColorTexture = g.TextureInfo(index=0, texCoord=1)
    file.gltf.materials = [g.Material(pbrMetallicRoughness=look, alphaMode="BLEND", doubleSided=True, alphaCutoff=None)]
    file.gltf.textures = [g.Texture(source=0)]
    file.gltf.images = [g.Image(bufferView=file.view(data), mimeType="image/png")]
    return file


@pytest.mark.parametrize("kind", ["PNG", "JPEG"])
def test_material_texture_and_vertex_colours_are_read(kind: str, tmp_path: Path) -> None:
    _, (surface,), _ = read_mesh(textured_file(picture(kind)).save(tmp_path / "a.glb"))
    material = surface.material
    assert material.base_color == (0.5, 0.6, 0.7, 0.8)
    assert (material.roughness, material.metallic) == (0.3, 0.1)
    assert (material.alpha_mode, material.double_sided) == ("BLEND", True)
    assert material.texture is not None
    assert material.texture.shape == (3, 2, 4)
    np.testing.assert_allclose(material.texture[0, 0], [200, 100, 50, 255], atol=3)
    assert surface.uv is not None
    np.testing.assert_array_equal(surface.uv[1], [1, 0])
    assert surface.colors is not None
    np.testing.assert_allclose(surface.colors[2], [1, 0, 0.2, 1])


def test_a_picture_that_is_damaged_foreign_or_outside_is_refused(tmp_path: Path) -> None:
    for data in (b"", b"GIF89a", picture("PNG")[:40], picture("BMP")):
        with pytest.raises(InputError, match=r"images\[0\] cannot be read as PNG or JPEG"):
            read_mesh(textured_file(data).save(tmp_path / "a.glb"))
    file = textured_file(picture("PNG"))
    file.gltf.images = [g.Image(uri="skin.png")]
    with pytest.raises(InputError, match="lies outside the GLB"):
        read_mesh(file.save(tmp_path / "a.glb"))


@pytest.mark.parametrize("side", [9_000, 100_000])
def test_a_picture_of_too_many_pixels_is_refused_before_it_is_decoded(side: int, tmp_path: Path) -> None:
    small = picture("PNG")
    header = b"IHDR" + side.to_bytes(4, "big") * 2 + small[24:29]
    huge = small[:12] + header + zlib.crc32(header).to_bytes(4, "big") + small[33:]
    with pytest.raises(InputError, match=r"pixels"):
        read_mesh(textured_file(huge).save(tmp_path / "a.glb"))
