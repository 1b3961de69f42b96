"""Unity clips, read back as YAML where a reader is at hand and line by line everywhere."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from retarget.errors import OutputError
from retarget.export.keys import Curve, fit_tracks, smooth_curve
from retarget.export.unity_anim import BoneCurve, Clip, ShapeCurve, joint_paths, path_hash, rig_clip, write_clip

if TYPE_CHECKING:
    from pathlib import Path


def angle_curve(times_s: list[float], degrees: list[float]) -> Curve:
    values = np.zeros((len(degrees), 3))
    values[:, 2] = degrees
    return smooth_curve(np.array(times_s), values)


def read_back(path: Path) -> dict[str, Any]:
    yaml = pytest.importorskip("yaml", reason="PyYAML reads the clip back, and is not installed")

    class Reader(yaml.SafeLoader):  # type: ignore[misc, name-defined]
        pass

    Reader.add_multi_constructor(
        "tag:unity3d.com,2011:", lambda loader, kind, node: {"class": kind, **loader.construct_mapping(node, deep=True)}
    )
    document = yaml.load(path.read_text(), Reader)
    assert document["class"] == "74"
    clip: dict[str, Any] = document["AnimationClip"]
    return clip


def clip_file(tmp_path: Path) -> Path:
    weights = smooth_curve(np.array([0.0, 0.5]), np.array([[0.0], [75.0]]))
    bones = [
        BoneCurve("hips/spine", "euler", angle_curve([0.0, 1 / 120, 2 / 120], [0.0, 90.0, 45.0])),
        BoneCurve("hips", "rotation", smooth_curve(np.array([0.0]), np.array([[0.0, 0.0, 0.0, 1.0]]))),
        BoneCurve("hips", "position", smooth_curve(np.array([0.0, 1.0]), np.array([[0.0, 1, 2], [1e-7, 4, 5]]))),
    ]
    path = tmp_path / "new" / "folder" / "a.anim"
    write_clip(path, Clip("a", bones, [ShapeCurve("Face: left", "jawOpen", weights)]))
    return path


def test_the_clip_reads_back_as_written(tmp_path: Path) -> None:
    clip = read_back(clip_file(tmp_path))
    assert (clip["m_Name"], clip["serializedVersion"], clip["m_SampleRate"]) == ("a", 6, 60)
    assert clip["m_AnimationClipSettings"]["m_StopTime"] == 1
    (euler,) = clip["m_EulerCurves"]
    assert euler["path"] == "hips/spine"
    keys = euler["curve"]["m_Curve"]
    assert [key["value"]["z"] for key in keys] == [0, 90, 45]
    assert [key["time"] for key in keys] == pytest.approx([0, 1 / 120, 2 / 120], abs=1e-9)
    assert keys[1]["inSlope"] == keys[1]["outSlope"] == {"x": 0, "y": 0, "z": pytest.approx(45 * 60, rel=1e-6)}
    (position,) = clip["m_PositionCurves"]
    assert position["curve"]["m_Curve"][1]["value"] == {"x": pytest.approx(1e-7), "y": 4, "z": 5}
    (rotation,) = clip["m_RotationCurves"]
    assert rotation["curve"]["m_Curve"][0]["value"] == {"x": 0, "y": 0, "z": 0, "w": 1}
    (shape,) = clip["m_FloatCurves"]
    assert (shape["attribute"], shape["path"], shape["classID"]) == ("blendShape.jawOpen", "Face: left", 137)


def test_every_key_has_the_fields_of_a_unity_clip(tmp_path: Path) -> None:
    clip = read_back(clip_file(tmp_path))
    fields = {"serializedVersion", "time", "value", "inSlope", "outSlope"}
    fields |= {"tangentMode", "weightedMode", "inWeight", "outWeight"}
    sections = ("m_EulerCurves", "m_RotationCurves", "m_PositionCurves", "m_FloatCurves", "m_EditorCurves")
    for entry in (entry for section in sections for entry in clip[section]):
        assert {"m_PreInfinity", "m_PostInfinity", "m_RotationOrder", "m_Curve"} <= entry["curve"].keys()
        for key in entry["curve"]["m_Curve"]:
            assert key.keys() == fields
            assert all(isinstance(n, int | float) for n in (key["time"], *_numbers(key["value"])))


def _numbers(value: object) -> list[object]:
    return list(value.values()) if isinstance(value, dict) else [value]


def test_editor_curves_repeat_every_component(tmp_path: Path) -> None:
    clip = read_back(clip_file(tmp_path))
    editor = {(c["path"], c["attribute"]): c["curve"]["m_Curve"] for c in clip["m_EditorCurves"]}
    assert len(editor) == 3 + 4 + 3 + 1
    turned = editor["hips/spine", "localEulerAnglesRaw.z"]
    assert [(k["time"], k["value"]) for k in turned][1] == (pytest.approx(1 / 120), 90)
    assert ("hips", "m_LocalRotation.w") in editor
    assert ("Face: left", "blendShape.jawOpen") in editor


def test_bindings_carry_the_hash_of_their_own_path(tmp_path: Path) -> None:
    assert path_hash("bone_1/bone_2/bone_3") == 134607859  # the number that Video2Anim writes for every bone
    text = clip_file(tmp_path).read_text()
    hashes = re.findall(r"^      path: (\d+)$", text, re.MULTILINE)
    assert hashes == [str(path_hash(path)) for path in ("hips/spine", "hips", "hips", "Face: left")]


def test_a_rig_turns_and_moves_as_in_a_mirror() -> None:
    quat = np.array([[[0.1, 0.2, 0.3, np.sqrt(1 - 0.14)]]])
    tracks = fit_tracks(np.zeros(1), np.array([[[1.0, 2.0, 3.0]]]), quat, np.array([[0.25]]))
    clip = rig_clip("a", tracks, joint_paths(["head"], [-1]), ["jawOpen"], renderers=["Face"])
    position, rotation = clip.bones
    np.testing.assert_allclose(position.curve.values, [[-1.0, 2.0, 3.0]])
    np.testing.assert_allclose(rotation.curve.values[0, :3], [0.1, -0.2, -0.3])
    np.testing.assert_allclose(clip.shapes[0].curve.values, [[25.0]])


def test_paths_run_from_the_root() -> None:
    assert joint_paths(["neck", "head", "jaw"], [-1, 0, 1]) == ["neck", "neck/head", "neck/head/jaw"]


def test_a_place_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        write_clip(tmp_path / "file" / "a.anim", Clip("a", ()))
