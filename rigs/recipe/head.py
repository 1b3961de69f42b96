"""Put the head together: person, skin, joints, features, pictures, file."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rigs.recipe import pictures
from rigs.recipe.atlas import pack
from rigs.recipe.complexion import complexion
from rigs.recipe.face import bind, head_of, rig_influences, skin_part
from rigs.recipe.features import eyes_part, lashes_part, mouth_part
from rigs.recipe.glb import Look, write_glb
from rigs.recipe.ground import survey
from rigs.recipe.hair import hair
from rigs.recipe.paint import canvas, jpeg, png
from rigs.recipe.person import person
from rigs.recipe.shapes import ARKIT
from rigs.recipe.skeleton import skeleton

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.face import Face
    from rigs.recipe.identity import Identity
    from rigs.recipe.person import Person
    from rigs.recipe.source import Wheel

SKIN_SIZE, SKIN_QUALITY = 1024, 90
HAIR_QUALITY = 88


def build(wheel: Wheel, identity: Identity) -> bytes:
    """The GLB file. Its frame ``rig`` has the origin at the foot of the neck, below the head joint."""
    human = person(wheel, identity)
    skin = head_of(human)
    foot = skin.positions(human.vertices)[:, 1].min()
    human = human.moved(-np.array([0.0, foot, human.eye_middle()[2] + identity.proportions.head_m[2]]))
    face = bind(skin, human, wheel)
    positions = face.skin.positions(human.vertices)
    joints = skeleton(human, {name: positions[vertex] for name, vertex in face.sites.items()})
    lip_mask = wheel.lip_mask()
    parts = [
        skin_part(face, human, joints, lip_mask),
        eyes_part(human, joints),
        mouth_part(human, joints),
        lashes_part(human, positions, rig_influences(face.binding, joints)),
    ]
    looks = [
        Look(_skin_picture(face, human, lip_mask), 0.62),
        Look(jpeg(pictures.eye(identity.palette, identity.proportions.iris_deg), 92), 0.12),
        Look(jpeg(pictures.mouth(), 90), 0.35),
        Look(png(identity.lashes.picture()), 0.9, double_sided=True),
    ]
    if identity.hairdo:
        part, picture = hair(identity.hairdo, face.skin, human, joints, identity.palette)
        parts.append(part)
        looks.append(Look(jpeg(picture, HAIR_QUALITY), 0.7, double_sided=True))
    asset = {"generator": f"retarget rigs/build_{identity.name}.py", "copyright": "CC0 1.0 Universal"}
    return write_glb(identity.name, parts, looks, joints, ARKIT, asset)


def _skin_picture(face: Face, human: Person, lip_mask: NDArray[np.float64]) -> bytes:
    place = human.on_canvas(face.skin)
    layer = canvas(pack(face.skin.uv), SKIN_SIZE)
    ground = survey(layer, face.skin, place, lip_mask)
    spots = {name: place[vertex] for name, vertex in face.sites.items()}
    return jpeg(layer.picture(complexion(ground, spots, human.identity.palette)), SKIN_QUALITY)
