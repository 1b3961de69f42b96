"""Materials of a glTF file: base colour, its picture, roughness, metalness, transparency.

Only what a rig's display uses is read; other maps are left alone. Reference: glTF 2.0, section 3.9 (materials).
"""

from __future__ import annotations

import io
import warnings
from typing import TYPE_CHECKING

import numpy as np

from retarget.errors import InputError
from retarget.rig.model import Material

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.rig.fields import Fields
    from retarget.rig.glb import Glb

MAX_PIXELS = 8192 * 8192

ALPHA_MODES = ("OPAQUE", "MASK", "BLEND")


class Materials:
    """The materials of one file, with every picture decoded once."""

    def __init__(self, glb: Glb) -> None:
        self._glb = glb
        self._pictures: dict[int, NDArray[np.uint8]] = {}

    def of(self, primitive: Fields) -> tuple[Material, int]:
        """The material of a primitive, a plain one where it has none, and which TEXCOORD set its picture uses."""
        if "material" not in primitive:
            return Material(), 0
        fields = self._glb.entry("materials", primitive.integer("material"))
        surface = fields.table("pbrMetallicRoughness")
        r, g, b, a = surface.numbers("baseColorFactor", 4, (1.0, 1.0, 1.0, 1.0))
        picture = surface.table("baseColorTexture")
        alpha_mode = fields.text("alphaMode", "OPAQUE")
        if alpha_mode not in ALPHA_MODES:
            raise fields.wrong("alphaMode", f"one of {', '.join(ALPHA_MODES)}")
        material = Material(
            base_color=(r, g, b, a),
            texture=self._picture(picture.integer("index")) if picture.data else None,
            roughness=surface.number("roughnessFactor", 1.0),
            metallic=surface.number("metallicFactor", 1.0),
            alpha_mode=alpha_mode,
            double_sided=fields.flag("doubleSided"),
        )
        return material, picture.integer("texCoord", 0)

    def _picture(self, texture: int) -> NDArray[np.uint8]:
        """(H, W, 4) sRGB with alpha."""
        index = self._glb.entry("textures", texture).integer("source")
        if index not in self._pictures:
            image = self._glb.entry("images", index)
            if "bufferView" not in image:
                raise InputError(f"{image.place} lies outside the GLB; export it with its pictures inside.")
            data, _ = self._glb.view(image.integer("bufferView"))
            self._pictures[index] = _decode(bytes(data), image.place)
        return self._pictures[index]


def _decode(data: bytes, place: str) -> NDArray[np.uint8]:
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore", Image.DecompressionBombWarning
            )  # the size is checked here, against our own limit
            picture = Image.open(io.BytesIO(data), formats=("PNG", "JPEG"))
        if picture.width * picture.height > MAX_PIXELS:
            raise InputError(
                f"{place} has {picture.width} x {picture.height} pixels; pictures up to 8192 x 8192 can be used."
            )
        return np.array(picture.convert("RGBA"))
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"{place} cannot be read as PNG or JPEG; export it again. ({error})") from error
