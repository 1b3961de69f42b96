"""Bytes of an independent writer, and every way to damage them."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from retarget.errors import InputError
from retarget.rig.glb import COMPRESSION, read_glb
from retarget.rig.load import load_rig
from tests.rig.glb_files import COMPONENT, GlbFile, rewrite_json, two_joint_file

if TYPE_CHECKING:
    from pathlib import Path

TYPES = tuple(COMPONENT)
RIG_TOML = 'name = "square"\nmesh = "rig.glb"\n[joints]\nhead = "head"\n[sites]\nchin = "jaw"\n'


def some_values(code: str, *shape: int) -> np.ndarray[Any, Any]:
    rng = np.random.default_rng(3)
    if code == "f4":
        return rng.normal(size=shape).astype("f4")
    limits = np.iinfo(code)
    return rng.integers(limits.min, limits.max, shape, endpoint=True).astype(code)


@pytest.fixture
def rig_folder(tmp_path: Path) -> Path:
    two_joint_file().save(tmp_path / "rig.glb")
    (tmp_path / "rig.toml").write_text(RIG_TOML)
    return tmp_path


@pytest.mark.parametrize("code", TYPES)
@pytest.mark.parametrize("shape", [(), (2,), (3,), (4,), (4, 4)])
def test_every_component_type_and_shape_is_read_as_written(code: str, shape: tuple[int, ...], tmp_path: Path) -> None:
    values = some_values(code, 5, *shape)
    file = GlbFile()
    index = file.accessor(values)
    read = read_glb(file.save(tmp_path / "a.glb")).array(index)
    assert read.dtype == values.dtype
    np.testing.assert_array_equal(read, values)


def test_interleaved_attributes_are_taken_apart_by_stride_and_offset(tmp_path: Path) -> None:
    vertices = np.zeros(7, [("position", "<f4", 3), ("joints", "<u1", 4), ("weights", "<u2", 4)])
    vertices["position"], vertices["joints"] = some_values("f4", 7, 3), some_values("u1", 7, 4)
    vertices["weights"] = some_values("u2", 7, 4)
    file = GlbFile()
    view = file.view(b"padding." + vertices.tobytes(), stride=24)
    fields = {"bufferView": view, "count": 7}
    a = file.add_accessor(byteOffset=8, componentType=5126, type="VEC3", **fields)
    b = file.add_accessor(byteOffset=20, componentType=5121, type="VEC4", **fields)
    c = file.add_accessor(byteOffset=24, componentType=5123, type="VEC4", **fields)
    glb = read_glb(file.save(tmp_path / "a.glb"))
    for index, name in ((a, "position"), (b, "joints"), (c, "weights")):
        np.testing.assert_array_equal(glb.array(index), vertices[name])


def test_columns_of_small_matrices_begin_on_multiples_of_four_bytes(tmp_path: Path) -> None:
    file = GlbFile()
    two = file.view(bytes([0, 1, 99, 99, 2, 3, 99, 99, 4, 5, 99, 99, 6, 7, 99, 99]))
    three = file.view(np.array([[0, 1, 2, 99], [3, 4, 5, 99], [6, 7, 8, 99]], np.uint16).tobytes())
    a = file.add_accessor(bufferView=two, componentType=5121, type="MAT2", count=2)
    b = file.add_accessor(bufferView=three, componentType=5123, type="MAT3", count=1)
    glb = read_glb(file.save(tmp_path / "a.glb"))
    np.testing.assert_array_equal(glb.array(a), [[[0, 2], [1, 3]], [[4, 6], [5, 7]]])
    np.testing.assert_array_equal(glb.array(b), [[[0, 3, 6], [1, 4, 7], [2, 5, 8]]])


def test_normalised_integers_become_the_fractions_of_the_specification(tmp_path: Path) -> None:
    cases: dict[str, tuple[list[int], list[float]]] = {
        "u1": ([0, 51, 255], [0, 0.2, 1]),
        "i1": ([-128, -127, 127], [-1, -1, 1]),
        "u2": ([0, 13107, 65535], [0, 0.2, 1]),
        "i2": ([-32768, -32767, 32767], [-1, -1, 1]),
    }
    for code, (raw, expected) in cases.items():
        file = GlbFile()
        index = file.accessor(np.array(raw, code), normalized=True)
        read = read_glb(file.save(tmp_path / "a.glb")).array(index)
        np.testing.assert_allclose(read, expected, atol=1e-7)


@pytest.mark.parametrize("index_code", ["u1", "u2", "u4"])
def test_sparse_values_replace_zeros_or_the_values_below(index_code: str, tmp_path: Path) -> None:
    base, new = some_values("f4", 9, 3), some_values("f4", 2, 3) + 1
    at = np.array([2, 7], index_code)
    file = GlbFile()
    alone = file.sparse(at, new, 9)
    over = file.sparse(at, new, 9, base=file.view(base.tobytes()))
    glb = read_glb(file.save(tmp_path / "a.glb"))
    expected = np.zeros((9, 3), np.float32)
    expected[[2, 7]] = new
    np.testing.assert_array_equal(glb.array(alone), expected)
    base[[2, 7]] = new
    np.testing.assert_array_equal(glb.array(over), base)


def test_a_sparse_index_beyond_the_elements_is_refused(tmp_path: Path) -> None:
    file = GlbFile()
    index = file.sparse(np.array([9], np.uint8), some_values("f4", 1, 3), 9)
    with pytest.raises(InputError, match="beyond the 9"):
        read_glb(file.save(tmp_path / "a.glb")).array(index)


@pytest.mark.parametrize(
    "fields",
    [
        {"count": 6},
        {"count": 2**62},
        {"byteOffset": 4},
        {"type": "VEC4"},
        {"componentType": 5124},
        {"type": "MAT5"},
        {"bufferView": 7},
        {"count": -1},
        {"bufferView": None, "count": 2**40},
    ],
)
def test_an_accessor_that_asks_for_more_than_its_bytes_is_refused(fields: dict[str, Any], tmp_path: Path) -> None:
    file = GlbFile()
    index = file.accessor(some_values("f4", 5, 3), **fields)
    glb = read_glb(file.save(tmp_path / "a.glb"))
    with pytest.raises(InputError, match=r"a\.glb"):
        glb.array(index)


def test_a_stride_smaller_than_the_element_is_refused(tmp_path: Path) -> None:
    file = GlbFile()
    index = file.accessor(some_values("f4", 5, 3), bufferView=file.view(bytes(60), stride=4))
    with pytest.raises(InputError, match="5 elements"):
        read_glb(file.save(tmp_path / "a.glb")).array(index)


def test_a_file_that_is_no_glb_is_told_by_its_beginning(tmp_path: Path) -> None:
    for content in (b"", b"glT", b'{"asset": {}}', b"C3D file", bytes(40)):
        (tmp_path / "a.glb").write_bytes(content)
        with pytest.raises(InputError, match=r"is not a GLB: it does not begin with 'glTF'"):
            read_glb(tmp_path / "a.glb")


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_glb(tmp_path / "a.glb")


def test_a_truncated_glb_says_how_many_bytes_are_expected_and_found(rig_folder: Path) -> None:
    whole = (rig_folder / "rig.glb").read_bytes()
    (rig_folder / "rig.glb").write_bytes(whole[:900])
    with pytest.raises(InputError, match=f"cut short: {len(whole)} bytes are expected, 900 are there"):
        load_rig(str(rig_folder))


def test_a_glb_cut_at_any_byte_is_refused_and_nothing_else_is_raised(rig_folder: Path) -> None:
    whole = (rig_folder / "rig.glb").read_bytes()
    for length in range(len(whole)):
        (rig_folder / "rig.glb").write_bytes(whole[:length])
        with pytest.raises(InputError):
            load_rig(str(rig_folder))


def test_a_glb_cut_at_any_byte_whose_header_hides_it_is_refused_too(rig_folder: Path) -> None:
    whole = (rig_folder / "rig.glb").read_bytes()
    for length in range(12, len(whole)):
        (rig_folder / "rig.glb").write_bytes(whole[:8] + struct.pack("<I", length) + whole[12:length])
        with pytest.raises(InputError):
            load_rig(str(rig_folder))


def test_an_old_version_is_refused(rig_folder: Path) -> None:
    whole = (rig_folder / "rig.glb").read_bytes()
    (rig_folder / "rig.glb").write_bytes(whole[:4] + struct.pack("<I", 1) + whole[8:])
    with pytest.raises(InputError, match="GLB of version 1; only version 2"):
        load_rig(str(rig_folder))


@pytest.mark.parametrize("name", COMPRESSION)
def test_compressed_files_are_refused_with_what_to_do(name: str, rig_folder: Path) -> None:
    whole = (rig_folder / "rig.glb").read_bytes()
    (rig_folder / "rig.glb").write_bytes(rewrite_json(whole, lambda d: d.update(extensionsRequired=[name])))
    with pytest.raises(InputError, match=f"{name}.*export it again uncompressed"):
        load_rig(str(rig_folder))


def test_an_unknown_required_extension_is_refused_and_one_that_only_shades_is_not(rig_folder: Path) -> None:
    whole = (rig_folder / "rig.glb").read_bytes()
    (rig_folder / "rig.glb").write_bytes(rewrite_json(whole, lambda d: d.update(extensionsRequired=["EXT_new"])))
    with pytest.raises(InputError, match="requires the extension EXT_new"):
        load_rig(str(rig_folder))
    shaded = rewrite_json(whole, lambda d: d.update(extensionsRequired=["KHR_materials_unlit"]))
    (rig_folder / "rig.glb").write_bytes(shaded)
    assert load_rig(str(rig_folder)).joints.names == ("head", "jaw")


def test_an_external_buffer_is_refused_with_what_to_do(rig_folder: Path) -> None:
    whole = (rig_folder / "rig.glb").read_bytes()
    (rig_folder / "rig.glb").write_bytes(rewrite_json(whole, lambda d: d["buffers"][0].update(uri="rig.bin")))
    with pytest.raises(InputError, match="outside its binary chunk; export it as one GLB"):
        load_rig(str(rig_folder))


def test_chunks_of_unknown_type_are_passed_over(rig_folder: Path) -> None:
    whole = (rig_folder / "rig.glb").read_bytes() + struct.pack("<II", 4, 0x58585858) + b"more"
    (rig_folder / "rig.glb").write_bytes(whole[:8] + struct.pack("<I", len(whole)) + whole[12:])
    assert load_rig(str(rig_folder)).joints.names == ("head", "jaw")


def places_of(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The path of every value inside a JSON document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for key, item in items for place in places_of(item, (*path, key)))]


STRANGE: st.SearchStrategy[Any] = st.sampled_from(
    [None, True, -1, 0, 1, 2, 3, 7, 255, 2**31, 2**63, 2**80, 0.5, 1e30, float("inf"), float("nan"), "", "x", [], {}]
) | st.lists(st.integers(-1, 4), max_size=4)


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_strange_values_anywhere_in_the_document_never_raise_anything_but_an_input_error(
    data: st.DataObject, rig_folder: Path
) -> None:
    whole = two_joint_file().save(rig_folder / "whole.glb").read_bytes()

    def spoil(document: Any) -> Any:
        *way, last = data.draw(st.sampled_from(places_of(document)[1:]))
        for key in way:
            document = document[key]
        if isinstance(document, dict) and data.draw(st.booleans()):
            del document[last]
        else:
            document[last] = data.draw(STRANGE)

    (rig_folder / "rig.glb").write_bytes(rewrite_json(whole, spoil))
    try:
        rig = load_rig(str(rig_folder))
    except InputError:
        return
    assert all(np.isfinite(s.positions).all() and np.isfinite(s.normals).all() for s in rig.surfaces)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.integers(0, 10_000), value=st.integers(0, 255))
@example(at=10, value=255)
def test_a_wrong_byte_anywhere_never_raises_anything_but_an_input_error(at: int, value: int, rig_folder: Path) -> None:
    whole = bytearray(two_joint_file().save(rig_folder / "rig.glb").read_bytes())
    whole[at % len(whole)] = value
    (rig_folder / "rig.glb").write_bytes(whole)
    try:
        rig = load_rig(str(rig_folder))
    except InputError:
        return
    assert all(np.isfinite(s.positions).all() for s in rig.surfaces)
