"""Key points of bodies in the plane (OpenPose) become a reduced, smooth animation of a 2D skeleton."""

from retarget.body2d.card import Bone, Card, load_card
from retarget.body2d.convert import MENDED, Converted, convert, convert_persons
from retarget.body2d.drawing import draw, write_film, write_picture
from retarget.body2d.read import Recording, read_poses
from retarget.body2d.settings import Rules, Settings
from retarget.body2d.turns import Turns, bone_turns

__all__ = [
    "MENDED",
    "Bone",
    "Card",
    "Converted",
    "Recording",
    "Rules",
    "Settings",
    "Turns",
    "bone_turns",
    "convert",
    "convert_persons",
    "draw",
    "load_card",
    "read_poses",
    "write_film",
    "write_picture",
]
