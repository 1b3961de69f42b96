"""What others call the blend shapes and the bones that ARKit and this package name: one table for all schemes.

Schemes of the 52 shapes: ARKit ``eyeBlinkLeft``; with a letter ``eyeBlink_L`` (iFacialMocap, ICT-FaceKit); in Pascal
case ``EyeBlinkLeft`` (Live Link Face, VRM's "Perfect Sync"). MediaPipe has ARKit's names in the order of the alphabet,
`_neutral` first, without `tongueOut`. VRM's presets and Oculus' visemes are whole mouths, so an ARKit shape is only
the nearest to them. Left and right are the character's.
References: Apple, ARFaceAnchor.BlendShapeLocation; VRM 0 specification, blendShapeMaster; VRMC_vrm 1.0, expressions;
Oculus Lipsync, viseme reference.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

ARKIT = (
    *(f"eye{what}Left" for what in ("Blink", "LookDown", "LookIn", "LookOut", "LookUp", "Squint", "Wide")),
    *(f"eye{what}Right" for what in ("Blink", "LookDown", "LookIn", "LookOut", "LookUp", "Squint", "Wide")),
    *("jawForward", "jawLeft", "jawRight", "jawOpen", "mouthClose", "mouthFunnel", "mouthPucker"),
    *("mouthLeft", "mouthRight", "mouthSmileLeft", "mouthSmileRight", "mouthFrownLeft", "mouthFrownRight"),
    *("mouthDimpleLeft", "mouthDimpleRight", "mouthStretchLeft", "mouthStretchRight"),
    *("mouthRollLower", "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper"),
    *("mouthPressLeft", "mouthPressRight", "mouthLowerDownLeft", "mouthLowerDownRight"),
    *("mouthUpperUpLeft", "mouthUpperUpRight", "browDownLeft", "browDownRight", "browInnerUp"),
    *("browOuterUpLeft", "browOuterUpRight", "cheekPuff", "cheekSquintLeft", "cheekSquintRight"),
    *("noseSneerLeft", "noseSneerRight", "tongueOut"),
)
"""In the order of Live Link Face, whose 52 shapes come before nine turns of head and eyes."""
MEDIAPIPE = ("_neutral", *sorted(set(ARKIT) - {"tongueOut"}))
WHOLE = ("jawLeft", "jawRight", "mouthLeft", "mouthRight")
"""Shapes whose last word is a direction, not one of two sides."""


class Viseme(NamedTuple):
    """A mouth or an eye in the schemes that have no ARKit shape for it; empty where a scheme lacks it."""

    vrm1: str
    vrm0: str
    oculus: str
    nearest: str
    """The ARKit shape that comes nearest."""


VISEMES = (
    Viseme("aa", "a", "viseme_aa", "jawOpen"),
    Viseme("ih", "i", "viseme_I", ""),
    Viseme("ou", "u", "viseme_U", "mouthPucker"),
    Viseme("ee", "e", "viseme_E", ""),
    Viseme("oh", "o", "viseme_O", "mouthFunnel"),
    Viseme("blinkLeft", "blink_l", "", "eyeBlinkLeft"),
    Viseme("blinkRight", "blink_r", "", "eyeBlinkRight"),
    Viseme("blink", "blink", "", ""),
    Viseme("happy", "joy", "", ""),
    Viseme("angry", "angry", "", ""),
    Viseme("sad", "sorrow", "", ""),
    Viseme("relaxed", "fun", "", ""),
    Viseme("surprised", "", "", ""),
    Viseme("neutral", "neutral", "", ""),
    Viseme("lookUp", "lookup", "", ""),
    Viseme("lookDown", "lookdown", "", ""),
    Viseme("lookLeft", "lookleft", "", ""),
    Viseme("lookRight", "lookright", "", ""),
    *(Viseme("", "", f"viseme_{v}", "") for v in ("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR")),
)

_BONES = {
    "head": ("head", "skull", "facehead", "headbone"),
    "neck": ("neck", "neck1", "neck01", "neckbone", "necklower"),
    "jaw": ("jaw", "jawbone", "lowerjaw", "mandible", "jawroot", "jawmaster"),
    "eye_left": ("lefteye", "eyeleft", "eyel", "leye", "leyeball", "eyeballleft", "faceeyel", "eyelbone"),
    "eye_right": ("righteye", "eyeright", "eyer", "reye", "reyeball", "eyeballright", "faceeyer", "eyerbone"),
}
"""Folded names by role: VRM humanoid (``leftEye``), Mixamo (``mixamorig:LeftEye``), MakeHuman (``eye.L``, ``neck01``),
Ready Player Me, Unreal, VRoid (``J_Adj_L_FaceEye``)."""
_PREFIXES = re.compile(r"^(mixamorig\d*|armature|character\d*|ccbase|def|org|bip0*1|bone|jbipc|jadj|jbip)+")
_HEAD_FIRST = re.compile(r"^(l|r)(faceeye|eye)$")


def letters(name: str) -> str:
    """An ARKit name with the side as a letter: ``eyeBlink_L``; unchanged where there is no side."""
    if name in WHOLE:
        return name
    return re.sub("(Left|Right)$", lambda side: f"_{side[0][0]}", name)


def pascal(name: str) -> str:
    """An ARKit name as Live Link Face and "Perfect Sync" have it: ``EyeBlinkLeft``."""
    return name[:1].upper() + name[1:]


def arkit_name(theirs: str) -> str | None:
    """The ARKit shape that a name in any of the schemes means exactly; None where it means none.

    A path before the name (``Head.jawOpen``, ``blendShape1:jawOpen``, ``Face.M_jawOpen``) is left off, and capitals,
    blanks, dashes and underscores do not count. Two halves of a shape that ARKit has as one (``browInnerUp_L``) both
    give its name.
    """
    for part in (theirs, re.split(r"[.:|/]", theirs)[-1]):
        folded = _fold(part)
        for candidate in (folded, _side_written_out(folded)):
            if candidate in _BY_FOLDED:
                return _BY_FOLDED[candidate]
        halves = re.sub("(left|right|l|r)$", "", folded)
        if halves in ("browinnerup", "cheekpuff") and halves != folded:
            return _BY_FOLDED[halves]
    return None


def nearest_arkit(theirs: str) -> str | None:
    """The ARKit shape nearest to one of VRM's presets or Oculus' visemes; None where none comes near."""
    folded = _fold(theirs)
    for viseme in VISEMES:
        if viseme.nearest and folded in {_fold(name) for name in viseme[:3] if name}:
            return viseme.nearest
    return None


def vrm1_name(vrm0: str) -> str:
    """VRM 1's name of a VRM 0 preset (``blink_l``: ``blinkLeft``); as it is where there is none."""
    return next((v.vrm1 for v in VISEMES if v.vrm0 and v.vrm1 and v.vrm0 == vrm0.lower()), vrm0)


def bone_roles(names: Iterable[str]) -> dict[str, str]:
    """Role (head, neck, jaw, eye_left, eye_right) to the first of `names` that means it, better known names first."""
    known = {name: _fold_bone(name) for name in names}
    roles = {}
    for role, forms in _BONES.items():
        found = next((name for form in forms for name, folded in known.items() if folded == form), None)
        if found is not None:
            roles[role] = found
    return roles


def site_name(bone: str, sites: Iterable[str]) -> str | None:
    """The site that a bone is named after (``lip_corner.L``: ``lipCornerLeft``); None where there is none."""
    folded = _PREFIXES.sub("", _fold(bone))
    by_folded = {site.lower(): site for site in sites}
    return by_folded.get(folded) or by_folded.get(_side_written_out(folded))


def _fold(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _side_written_out(folded: str) -> str:
    """A folded name with its last letter written out as a side."""
    if folded.endswith("l"):
        return folded[:-1] + "left"
    return folded[:-1] + "right" if folded.endswith("r") else folded


def _fold_bone(name: str) -> str:
    folded = _PREFIXES.sub("", _fold(name)) or _fold(name)
    side = _HEAD_FIRST.match(folded)
    return f"eye{side[1]}" if side else folded


_BY_FOLDED = {name.lower(): name for name in ARKIT}
