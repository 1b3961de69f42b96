"""Unity's animation clip `*.anim` as text: bones by Euler or quaternion curves, blend shapes, editor curves.

Unity is left-handed, +Y up; whoever makes a clip gives values in Unity's axes, as `rig_clip` does. Angles in degrees,
weights of blend shapes in percent. Numbers are written so that single precision, which Unity uses, is exact. Form:
serialised AnimationClip, version 6 (YAML 1.1, class 74). Bindings name a path or a blend shape by its CRC-32.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from retarget.errors import OutputError
from retarget.export.keys.curve import Curve

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from retarget.export.keys.tracks import Tracks

Part = Literal["position", "rotation", "euler"]

_SECTIONS: dict[Part, str] = {"rotation": "m_RotationCurves", "euler": "m_EulerCurves", "position": "m_PositionCurves"}
_PROPERTIES: dict[Part, str] = {
    "position": "m_LocalPosition",
    "rotation": "m_LocalRotation",
    "euler": "localEulerAnglesRaw",
}
_ATTRIBUTES: dict[Part, int] = {"position": 1, "rotation": 2, "euler": 4}
_TRANSFORM = 4
_SKINNED_MESH_RENDERER = 137
_EULER_BINDING = 4
_BLEND_SHAPE_BINDING = 20
_MIRROR_POSITION = np.array([-1.0, 1.0, 1.0])
_MIRROR_ROTATION = np.array([1.0, -1.0, -1.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class BoneCurve:
    """How one part of a bone moves, relative to its parent."""

    path: str
    """Names from below the animated object down to the bone, as in ``bone_1/bone_2``."""
    part: Part
    curve: Curve
    """3 components: position, or Euler angles [deg]; 4 for a quaternion xyzw."""


@dataclass(frozen=True, slots=True, eq=False)
class ShapeCurve:
    """How one blend shape moves."""

    path: str
    """The object that has the skinned mesh."""
    name: str
    curve: Curve
    """1 component, percent."""


@dataclass(frozen=True, slots=True, eq=False)
class Clip:
    """A whole `*.anim`."""

    name: str
    bones: Sequence[BoneCurve]
    shapes: Sequence[ShapeCurve] = ()
    rate_hz: float = 60.0
    """What Unity's editor snaps to; keys stand at their own times."""
    stop_s: float | None = None
    """The end; by default the last key's time."""

    @property
    def duration_s(self) -> float:
        """Time at which the clip ends, or begins again [s]."""
        if self.stop_s is not None:
            return self.stop_s
        curves = [bone.curve for bone in self.bones] + [shape.curve for shape in self.shapes]
        return max((float(curve.times_s[-1]) for curve in curves), default=0.0)


def write_clip(path: Path, clip: Clip) -> None:
    """Write `clip`, and the folders above it where they are missing. Raises OutputError."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", encoding="utf-8", newline="\n") as file:
            file.writelines(f"{line}\n" for line in _document(clip))
    except OSError as error:
        raise OutputError(f"{path} cannot be written ({error.strerror}): choose another place.") from None


def path_hash(path: str) -> int:
    """What a binding says for a path or an attribute."""
    return zlib.crc32(path.encode())


def joint_paths(names: Sequence[str], parents: Sequence[int]) -> list[str]:
    """Path of each joint; `parents` (J,) holds -1 for a root and stands before its children."""
    paths: list[str] = []
    for name, parent in zip(names, parents, strict=True):
        paths.append(name if parent < 0 else f"{paths[parent]}/{name}")
    return paths


def rig_clip(
    name: str, tracks: Tracks, paths: Sequence[str], shape_names: Sequence[str], *, renderers: Sequence[str] = ("",)
) -> Clip:
    """A clip of a glTF rig: joints at `paths` (J,), blend shapes (B,) of the objects at each of `renderers`.

    +X is turned round, as Unity's glTF importers (glTFast, UnityGLTF) do with the rig itself.
    """
    bones = [
        BoneCurve(p, "position", _times(c, _MIRROR_POSITION)) for p, c in zip(paths, tracks.translations, strict=True)
    ]
    bones += [
        BoneCurve(p, "rotation", _times(c, _MIRROR_ROTATION)) for p, c in zip(paths, tracks.rotations, strict=True)
    ]
    percent = [_times(curve, np.array([100.0])) for curve in tracks.weights]
    shapes = [ShapeCurve(r, shape, curve) for r in renderers for shape, curve in zip(shape_names, percent, strict=True)]
    return Clip(name, bones, shapes)


def _times(curve: Curve, factors: np.typing.NDArray[np.float64]) -> Curve:
    return Curve(curve.times_s, curve.values * factors, curve.in_slopes * factors, curve.out_slopes * factors)


def _document(clip: Clip) -> Iterator[str]:
    yield from ("%YAML 1.1", "%TAG !u! tag:unity3d.com,2011:", "--- !u!74 &7400000", "AnimationClip:")
    yield from ("  m_ObjectHideFlags: 0", "  m_CorrespondingSourceObject: {fileID: 0}")
    yield from ("  m_PrefabInstance: {fileID: 0}", "  m_PrefabAsset: {fileID: 0}")
    yield from (f"  m_Name: {_quoted(clip.name)}", "  serializedVersion: 6")
    yield from ("  m_Legacy: 0", "  m_Compressed: 0", "  m_UseHighQualityCurve: 1")
    yield from _section("m_RotationCurves", _bone_curves(clip, "rotation"))
    yield "  m_CompressedRotationCurves: []"
    yield from _section("m_EulerCurves", _bone_curves(clip, "euler"))
    yield from _section("m_PositionCurves", _bone_curves(clip, "position"))
    yield "  m_ScaleCurves: []"
    yield from _section("m_FloatCurves", _shape_curves(clip))
    yield "  m_PPtrCurves: []"
    yield f"  m_SampleRate: {_number(clip.rate_hz)}"
    yield from ("  m_WrapMode: 0", "  m_Bounds:")
    yield from ("    m_Center: {x: 0, y: 0, z: 0}", "    m_Extent: {x: 0, y: 0, z: 0}")
    yield "  m_ClipBindingConstant:"
    yield from _section("  genericBindings", _bindings(clip))
    yield "    pptrCurveMapping: []"
    yield from _settings(clip)
    yield from _section("m_EditorCurves", _editor_curves(clip))
    yield from ("  m_EulerEditorCurves: []", "  m_HasGenericRootTransform: 0", "  m_HasMotionFloatCurves: 0")
    yield "  m_Events: []"


def _section(name: str, lines: Iterator[str]) -> Iterator[str]:
    first = next(lines, None)
    if first is None:
        yield f"  {name}: []"
        return
    yield f"  {name}:"
    yield first
    yield from lines


def _bone_curves(clip: Clip, part: Part) -> Iterator[str]:
    for bone in clip.bones:
        if bone.part == part:
            yield from _curve_lines(bone.curve)
            yield f"    path: {_quoted(bone.path)}"


def _shape_curves(clip: Clip) -> Iterator[str]:
    for shape in clip.shapes:
        yield from _scalar_lines(shape.curve, 0, f"blendShape.{shape.name}", shape.path, _SKINNED_MESH_RENDERER)


def _editor_curves(clip: Clip) -> Iterator[str]:
    """The same curves number by number, which is what Unity's animation window shows and edits."""
    for bone in clip.bones:
        for component in range(bone.curve.values.shape[1]):
            attribute = f"{_PROPERTIES[bone.part]}.{'xyzw'[component]}"
            yield from _scalar_lines(bone.curve, component, attribute, bone.path, _TRANSFORM)
    yield from _shape_curves(clip)


def _scalar_lines(curve: Curve, component: int, attribute: str, path: str, class_id: int) -> Iterator[str]:
    one = slice(component, component + 1)
    yield from _curve_lines(
        Curve(curve.times_s, curve.values[:, one], curve.in_slopes[:, one], curve.out_slopes[:, one])
    )
    yield f"    attribute: {_quoted(attribute)}"
    yield f"    path: {_quoted(path)}"
    yield f"    classID: {class_id}"
    yield "    script: {fileID: 0}"


def _curve_lines(curve: Curve) -> Iterator[str]:
    yield from ("  - curve:", "      serializedVersion: 2", "      m_Curve:")
    third = _vector([1 / 3] * curve.values.shape[1])
    rows = zip(
        curve.times_s.tolist(), curve.values.tolist(), curve.in_slopes.tolist(), curve.out_slopes.tolist(), strict=True
    )
    for time_s, value, arriving, leaving in rows:
        yield "      - serializedVersion: 3"
        yield f"        time: {_number(time_s)}"
        yield f"        value: {_vector(value)}"
        yield f"        inSlope: {_vector(arriving)}"
        yield f"        outSlope: {_vector(leaving)}"
        yield "        tangentMode: 0"
        yield "        weightedMode: 0"
        yield f"        inWeight: {third}"
        yield f"        outWeight: {third}"
    yield from ("      m_PreInfinity: 2", "      m_PostInfinity: 2", "      m_RotationOrder: 4")


def _bindings(clip: Clip) -> Iterator[str]:
    for bone in clip.bones:
        custom = _EULER_BINDING if bone.part == "euler" else 0
        yield from _binding(bone.path, _ATTRIBUTES[bone.part], _TRANSFORM, custom)
    for shape in clip.shapes:
        attribute = path_hash(f"blendShape.{shape.name}")
        yield from _binding(shape.path, attribute, _SKINNED_MESH_RENDERER, _BLEND_SHAPE_BINDING)


def _binding(path: str, attribute: int, class_id: int, custom: int) -> Iterator[str]:
    yield "    - serializedVersion: 2"
    yield f"      path: {path_hash(path) if path else 0}"
    yield f"      attribute: {attribute}"
    yield "      script: {fileID: 0}"
    yield f"      typeID: {class_id}"
    yield f"      customType: {custom}"
    yield "      isPPtrCurve: 0"


def _settings(clip: Clip) -> Iterator[str]:
    yield from ("  m_AnimationClipSettings:", "    serializedVersion: 2")
    yield from ("    m_AdditiveReferencePoseClip: {fileID: 0}", "    m_AdditiveReferencePoseTime: 0")
    yield from ("    m_StartTime: 0", f"    m_StopTime: {_number(clip.duration_s)}", "    m_OrientationOffsetY: 0")
    yield from ("    m_Level: 0", "    m_CycleOffset: 0", "    m_HasAdditiveReferencePose: 0", "    m_LoopTime: 1")
    yield from ("    m_LoopBlend: 0", "    m_LoopBlendOrientation: 0", "    m_LoopBlendPositionY: 0")
    yield from ("    m_LoopBlendPositionXZ: 0", "    m_KeepOriginalOrientation: 0", "    m_KeepOriginalPositionY: 1")
    yield from ("    m_KeepOriginalPositionXZ: 0", "    m_HeightFromFeet: 0", "    m_Mirror: 0")


def _vector(values: Sequence[float]) -> str:
    if len(values) == 1:
        return _number(values[0])
    return "{" + ", ".join(f"{axis}: {_number(v)}" for axis, v in zip("xyzw", values, strict=False)) + "}"


def _number(value: float) -> str:
    """Nine digits, which single precision needs; never with an exponent that lacks its point, a text in YAML 1.1."""
    text = f"{value:.9g}"
    mantissa, sign, exponent = text.partition("e")
    return f"{mantissa if '.' in mantissa else mantissa + '.0'}e{exponent}" if sign else text


def _quoted(text: str) -> str:
    """A YAML scalar: plain where that is safe, else in single quotes on one line."""
    plain = text and text[0].isalpha() and all(c.isalnum() or c in "_/.-" for c in text)
    reserved = text.lower() in {"y", "n", "yes", "no", "on", "off", "true", "false", "null"}
    if plain and not reserved and text.isascii():
        return text
    return "" if not text else "'" + " ".join(text.split()).replace("'", "''") + "'"
