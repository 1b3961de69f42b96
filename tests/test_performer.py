"""The performer and its file."""

from __future__ import annotations

import datetime
import math
import stat
import string
import tomllib
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from retarget.errors import InputError, OutputError
from retarget.performer import (
    QUALITY,
    Performer,
    PerformerJaw,
    gain_matrix,
    load_performer,
    moved_by,
    performer_text,
    save_performer,
)

if TYPE_CHECKING:
    from pathlib import Path

JAW = PerformerJaw(
    axis=np.array([1.0, 0.0, 0.0]),
    pivot=np.array([0.0, 0.061, 0.012]),
    gain=0.9,
    min_rad=0.0,
    max_rad=math.radians(30),
    mode="signed",
)
ANA = Performer(
    name="ana",
    rig="human",
    layout="face24",
    date=datetime.date(2026, 3, 4),
    markers=("headFrontLeft", "browInnerLeft", "chin"),
    head_markers=("headFrontLeft",),
    neutral=np.array([[0.06, 0.17, 0.08], [0.015, 0.115, 0.095], [np.nan, np.nan, np.nan]]),
    noise=np.array([0.0001, np.nan, np.nan]),
    scale=0.95,
    K={"browInnerLeft": gain_matrix(0.9), "chin": gain_matrix([0.5, 0.8, 1.0])},
    jaw=JAW,
)


@pytest.fixture
def ana_toml(tmp_path: Path) -> Path:
    path = tmp_path / "ana.toml"
    save_performer(ANA, path)
    return path


def assert_same(a: Performer, b: Performer) -> None:
    """Equal to the precision of the file: lengths to 0.1 um, factors to seven digits."""
    for field in ("name", "rig", "layout", "date", "markers", "head_markers"):
        assert getattr(a, field) == getattr(b, field)
    np.testing.assert_allclose(a.neutral, b.neutral, atol=0.51e-7, rtol=1e-9)
    np.testing.assert_allclose(a.noise, b.noise, atol=0.51e-7, rtol=1e-9)
    assert a.scale == pytest.approx(b.scale, rel=1e-6)
    assert a.K.keys() == b.K.keys()
    for site in a.K:
        np.testing.assert_allclose(a.K[site], b.K[site], rtol=1e-6)
    assert a.fixed == b.fixed
    assert a.ranges.keys() == b.ranges.keys()
    for site in a.ranges:
        np.testing.assert_allclose(a.ranges[site], b.ranges[site], atol=0.51e-7, rtol=1e-9)
    assert dict(a.quality) == pytest.approx(dict(b.quality), rel=1e-3)
    assert (a.jaw is None) == (b.jaw is None)
    if a.jaw and b.jaw:
        np.testing.assert_allclose(a.jaw.axis, b.jaw.axis, atol=1e-6)
        np.testing.assert_allclose(a.jaw.pivot, b.jaw.pivot, atol=1e-7, rtol=1e-9)
        numbers = ("gain", "min_rad", "max_rad")
        assert [getattr(a.jaw, n) for n in numbers] == pytest.approx([getattr(b.jaw, n) for n in numbers], rel=1e-6)
        assert a.jaw.mode == b.jaw.mode
        slides = ("forward_m", "left_m", "right_m")
        ours, theirs = ([getattr(jaw, n) for n in slides] for jaw in (a.jaw, b.jaw))
        np.testing.assert_allclose(ours, theirs, atol=0.51e-7, rtol=1e-9)


def performers() -> st.SearchStrategy[Performer]:
    """Any performer, with names that no sane person gives."""
    text = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
    metres = st.floats(-2, 2)
    factor = st.floats(-10, 10).map(lambda x: 0.0 if abs(x) < 1e-30 else x)
    shapes = st.sampled_from([(3,), (3, 3), (2, 3)])
    gain = st.one_of(factor, shapes.flatmap(lambda shape: hnp.arrays(float, shape, elements=factor)))
    slide = st.just(math.nan) | st.floats(0, 0.05)
    vector = hnp.arrays(float, 3, elements=metres)
    direction = hnp.arrays(float, 3, elements=st.floats(-1, 1)).filter(lambda v: np.linalg.norm(v) > 0.1)
    jaw = st.builds(
        PerformerJaw,
        axis=direction.map(lambda v: v / np.linalg.norm(v)),
        pivot=vector,
        gain=factor,
        min_rad=st.floats(-math.pi, -1e-6),
        max_rad=st.floats(1e-6, math.pi),
        mode=st.sampled_from(["signed", "cosine"]),
        forward_m=slide,
        left_m=slide,
        right_m=slide,
    )

    def with_markers(names: list[str]) -> st.SearchStrategy[Performer]:
        gone = st.lists(st.booleans(), min_size=len(names), max_size=len(names))
        positions = hnp.arrays(float, (len(names), 3), elements=metres)
        noise = hnp.arrays(float, len(names), elements=st.floats(0, 0.01) | st.just(math.nan))
        return st.builds(
            Performer,
            name=text,
            rig=text,
            layout=text,
            date=st.dates(),
            markers=st.just(tuple(names)),
            head_markers=st.just(tuple(names[::2])),
            neutral=st.builds(lambda p, g: np.where(np.array(g, bool)[:, None], np.nan, p), positions, gone),
            noise=noise,
            scale=st.floats(1e-3, 1e3),
            K=st.dictionaries(text, gain.map(gain_matrix), max_size=3),
            jaw=st.none() | jaw,
            ranges=st.dictionaries(text, hnp.arrays(float, (2, 3), elements=metres), max_size=2),
            quality=st.dictionaries(st.sampled_from(sorted(QUALITY)), st.floats(0, 100), max_size=3),
            fixed=st.sampled_from([(), ("scale",)]),
        )

    return st.lists(text, max_size=5, unique=True).flatmap(with_markers)


@given(performer=performers())
def test_a_performer_comes_back_from_its_file_and_the_second_file_is_the_first(
    performer: Performer, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.toml"
    save_performer(performer, path)
    loaded = load_performer(path)
    assert_same(performer, loaded)
    assert performer_text(loaded) == path.read_text("utf-8")


def test_a_gain_is_written_as_briefly_as_it_can_be() -> None:
    K = {"a": gain_matrix(0.5), "b": gain_matrix([0.5, 1, 1]), "c": np.arange(9.0).reshape(3, 3)}
    written = tomllib.loads(performer_text(replace(ANA, K=K)))["K"]
    assert written == {"a": 0.5, "b": [0.5, 1, 1], "c": [[0, 1, 2], [3, 4, 5], [6, 7, 8]]}


def test_a_gain_that_differs_by_direction_names_its_directions() -> None:
    K = {"a": gain_matrix([[0.5, 0.6, 0.7], [0.5, 0.2, 0.3]])}
    written = tomllib.loads(performer_text(replace(ANA, K=K)))["K"]
    assert written == {"a": {"x": 0.5, "up": 0.6, "down": 0.2, "forward": 0.7, "back": 0.3}}


def test_directions_that_a_person_types_are_those_of_the_performer(ana_toml: Path) -> None:
    edited(ana_toml, "chin = [0.5, 0.8, 1]", "chin = { left = 1, right = 2, up = 3, down = 4, z = 5 }")
    K = load_performer(ana_toml).K["chin"]
    moved = moved_by(K, np.array([[0.001, 0.001, 0.001], [-0.001, -0.001, -0.001]]))
    np.testing.assert_allclose(1e3 * moved, [[1, 3, 5], [-2, -4, -5]])


def test_a_file_without_what_calibration_adds_still_loads(ana_toml: Path) -> None:
    text = ana_toml.read_text()
    assert not any(key in text for key in ("[ranges]", "[quality]", "fixed", "forward_m"))
    performer = load_performer(ana_toml)
    assert (dict(performer.ranges), dict(performer.quality), performer.fixed) == ({}, {}, ())
    assert performer.jaw is not None
    assert math.isnan(performer.jaw.forward_m)


def test_a_marker_without_a_neutral_is_left_out_and_read_as_missing(ana_toml: Path) -> None:
    assert list(tomllib.loads(ana_toml.read_text())["neutral"]) == ["headFrontLeft", "browInnerLeft"]
    assert np.isnan(load_performer(ana_toml).neutral).tolist() == [[False] * 3, [False] * 3, [True] * 3]


def test_the_head_template_is_the_neutral_of_the_head_markers() -> None:
    np.testing.assert_array_equal(ANA.head_template, [[0.06, 0.17, 0.08]])


def test_an_axis_that_a_person_typed_becomes_a_unit_vector(ana_toml: Path) -> None:
    edited(ana_toml, "axis = [1.0000000, 0.0000000, 0.0000000]", "axis = [3, 0, 4]")
    jaw = load_performer(ana_toml).jaw
    assert jaw is not None
    np.testing.assert_allclose(jaw.axis, [0.6, 0, 0.8])


def edited(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("gain = 0.9", "gian = 0.9", ["'gian' in [jaw] on line 14", "did you mean 'gain'"]),
        ("scale = 0.95", "sacle = 0.95", ["'sacle' on line 7", "did you mean 'scale'"]),
        ("[neutral]", "[neutrals]", ["'neutrals'", "did you mean 'neutral'"]),
        ("chin = [0.5, 0.8, 1]", "chin = [0.5, 0.8]", ["'chin' in [K] on line 21", "three rows of three numbers"]),
        ("chin = [0.5, 0.8, 1]", "chin = [0.5, 0.8, nan]", ["'chin' in [K]", "finite"]),
        ("chin = [0.5, 0.8, 1]", 'chin = "lots"', ["'chin' in [K]", "a number"]),
        ("chin = [0.5, 0.8, 1]", "chin = true", ["'chin' in [K]", "a number"]),
        ("chin = [0.5, 0.8, 1]", "chin = [[1, 2, 3], [4, 5], [6]]", ["'chin' in [K]", "three rows"]),
        ("browInnerLeft = [0.015", "browInerLeft = [0.015", ["in [neutral]", "did you mean 'browInnerLeft'"]),
        ("[0.0150000, 0.1150000, 0.0950000]", "[0.015, inf, 0.095]", ["in [neutral]", "three numbers"]),
        ('mode = "signed"', 'mode = "sinus"', ["'mode' in [jaw]", "signed or cosine"]),
        ("max_deg = 30", "max_deg = -5", ["'max_deg' in [jaw]", "either side of 0"]),
        ("axis = [1.0000000,", "axis = [0.0,", ["'axis' in [jaw]", "direction"]),
        ("version = 1", "version = 2", ["'version' on line 1", "reads version 1"]),
        ('units = "m"', 'units = "mm"', ["'units' on line 2"]),
        ("date = 2026-03-04", 'date = "4 March"', ["'date'", "2026-01-31"]),
        ("scale = 0.95", "scale = -0.95", ["'scale'", "above zero"]),
        ("scale = 0.95", "", ["'scale' is missing"]),
        ('head_markers = ["headFrontLeft"]', 'head_markers = ["crown"]', ["'crown'"]),
        ("markers = [", "markers = [3, ", ["'markers'", "list of different names"]),
        ("[jaw]", "[[jaw]]", ["'jaw'", "must be a table"]),
        ("chin = [0.5, 0.8, 1]", "chin = { x = 1, up = 0.5, down = 0.6 }", ["'forward' in [chin] is missing"]),
        (
            "chin = [0.5, 0.8, 1]",
            "chin = { x = 1, y = 1, z = 1, up = 0.5 }",
            ["'y' in [chin]", "stands for up and down"],
        ),
        (
            "chin = [0.5, 0.8, 1]",
            "chin = { x = 1, y = 1, foward = 1, back = 1 }",
            ["'foward'", "did you mean 'forward'"],
        ),
        ("scale = 0.95", 'scale = 0.95\nfixed = ["K.chim.up"]', ["'fixed' on line 8", "did you mean 'K.chin.up'"]),
        ("scale = 0.95", 'scale = 0.95\nfixed = ["everything"]', ["'fixed' on line 8", "no value here"]),
        ("[neutral]", "[ranges]\nchin = [0.1, 0.2]\n[neutral]", ["'chin' in [ranges]", "six numbers"]),
        ("[neutral]", "[quality]\nbeauty = 1\n[neutral]", ["'beauty' in [quality]", "the keys here are"]),
        ("gain = 0.9", "gain = 0.9\nforward_m = inf", ["'forward_m' in [jaw]", "finite"]),
        ("version = 1", "version 1", ["not a TOML text", "line 1"]),
        ("version = 1", "version = " + "[" * 5000, ["not a TOML text"]),
        ("version = 1", "version = " + "9" * 5000, ["not a TOML text"]),
    ],
)
def test_a_wrong_performer_file_is_refused_in_one_sentence_with_the_place(
    ana_toml: Path, old: str, new: str, words: list[str]
) -> None:
    edited(ana_toml, old, new)
    with pytest.raises(InputError) as caught:
        load_performer(ana_toml)
    message = str(caught.value)
    assert "\n" not in message
    for word in [*words, "ana.toml"]:
        assert word in message


@given(data=st.data())
def test_no_damage_to_the_file_ends_in_anything_but_an_input_error(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    text = performer_text(ANA)
    start = data.draw(st.integers(0, len(text)))
    end = min(len(text), start + data.draw(st.integers(0, 20)))
    damage = data.draw(st.text(string.printable, max_size=6))
    path = tmp_path_factory.getbasetemp() / "damaged.toml"
    path.write_text(text[:start] + damage + text[end:], newline="")
    try:
        performer = load_performer(path)
    except InputError:
        return
    assert np.isfinite(performer.scale)
    assert all(matrix.shape in ((3, 3), (2, 3, 3)) and np.isfinite(matrix).all() for matrix in performer.K.values())


def test_a_file_that_is_not_there_or_no_text_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nobody\.toml cannot be read"):
        load_performer(tmp_path / "nobody.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"bytes\.toml is not a TOML text"):
        load_performer(tmp_path / "bytes.toml")


def test_a_save_that_fails_leaves_the_old_file_and_nothing_else(
    ana_toml: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = ana_toml.read_text()

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OutputError, match=r"ana\.toml cannot be written: No space left on device"):
        save_performer(replace(ANA, name="bea"), ana_toml)
    assert ana_toml.read_text() == before
    assert list(ana_toml.parent.iterdir()) == [ana_toml]


def test_saving_where_there_is_no_folder_is_an_output_error(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        save_performer(ANA, tmp_path / "nowhere" / "ana.toml")


def test_others_may_read_the_file(ana_toml: Path) -> None:
    assert stat.S_IMODE(ana_toml.stat().st_mode) & 0o444 == 0o444


def test_a_gain_of_another_shape_is_a_value_error() -> None:
    with pytest.raises(ValueError, match=r"\(2,\)"):
        gain_matrix([1.0, 2.0])
