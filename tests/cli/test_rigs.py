"""`retarget rigs` lists; `retarget rigs add` makes a rig that is found by its name from then on."""

from __future__ import annotations

import json
import logging
from typing import TYPE_CHECKING

import pytest
from click.testing import CliRunner

from retarget.cli.main import main
from retarget.rig.library import user_folder
from retarget.rig.load import available_rigs, load_rig
from tests.rig.vrm_files import bare, vrm1

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RETARGET_RIGS", str(tmp_path / "rigs"))
    return tmp_path / "rigs"


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["rigs", *arguments])
    return result.exit_code, result.output


def test_the_bare_command_lists_the_rigs_that_ship() -> None:
    status, text = run()
    assert status == 0
    assert "human" in text
    assert "nova" in text
    assert {rig["name"] for rig in json.loads(run("--json")[1])} == {"human", "nova"}


def test_an_added_rig_is_found_by_name_and_listed(tmp_path: Path, home: Path) -> None:
    status, text = run("add", str(vrm1(tmp_path / "my.vrm")), "--name", "mine")
    assert status == 0
    assert "--rig mine" in text
    assert load_rig("mine").path == home / "mine" / "rig.toml"
    assert "mine" in run()[1]


def test_the_report_for_a_script_names_what_could_not_be_mapped(tmp_path: Path) -> None:
    path = bare(tmp_path / "my.glb", lambda name: "smirk" if name == "cheekPuff" else name)
    report = json.loads(run("add", str(path), "--json")[1])
    assert report["unmapped"] == ["smirk"]
    assert report["missing"] == ["cheekPuff"]


def test_a_refusal_is_one_sentence_and_status_1(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("x")
    status, text = run("add", str(tmp_path / "a.txt"))
    assert status == 1
    assert text.count("\n") == 1


def test_a_broken_rig_of_the_users_is_passed_over_with_a_warning(home: Path, caplog: pytest.LogCaptureFixture) -> None:
    (home / "broken").mkdir(parents=True)
    (home / "broken" / "rig.toml").write_text("nonsense")
    with caplog.at_level(logging.WARNING):
        assert {rig.name for rig in available_rigs()} == {"human", "nova"}
    assert "'broken' cannot be used" in caplog.text


def test_the_users_folder_follows_xdg(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("RETARGET_RIGS")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert user_folder() == tmp_path / "retarget" / "rigs"
    monkeypatch.delenv("XDG_DATA_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert user_folder() == tmp_path / ".local" / "share" / "retarget" / "rigs"
