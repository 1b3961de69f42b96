"""The strict TOML reader, where the files that use it do not lead."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from retarget.errors import InputError
from retarget.toml_table import MAX_FILE_BYTES, read_table

if TYPE_CHECKING:
    from pathlib import Path


def test_a_key_is_placed_by_its_table_and_line(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text("x = 1\n\n[jaw]  # the hinge\nx = 2\n'y z' = true\n")
    root = read_table(path, "test file")
    assert root.place("x") == "'x' on line 1"
    assert root.table("jaw").place("x") == "'x' in [jaw] on line 4"
    assert root.table("jaw").place("y z") == "'y z' in [jaw] on line 5"


def test_a_key_inside_a_table_on_one_line_is_placed_without_a_line(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text("jaw = { gian = 1 }\n")
    with pytest.raises(InputError, match=r"unknown key 'gian' in \[jaw\]; did you mean 'gain'\?"):
        read_table(path, "test file").table("jaw").only("gain", "axis")


def test_an_unknown_key_like_no_other_is_answered_with_the_keys_there_are(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text("colour = 1\n")
    with pytest.raises(InputError, match="the keys here are gain, axis"):
        read_table(path, "test file").only("gain", "axis")


def test_a_table_that_is_not_there_is_empty(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text("")
    assert dict(read_table(path, "test file").table("jaw").values) == {}


def test_a_file_that_is_no_configuration_by_its_size_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_bytes(b"#" * (MAX_FILE_BYTES + 1))
    with pytest.raises(InputError, match=r"a\.toml is too large for a test file"):
        read_table(path, "test file")


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"The test file .* cannot be read"):
        read_table(tmp_path, "test file")
