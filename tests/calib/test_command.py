"""`python -m calib performer`, as a user types it."""

from __future__ import annotations

import html.parser
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from click.testing import CliRunner

from calib.__main__ import main
from retarget.performer import load_performer
from tests.synthetic.demo_take import write_c3d
from tests.synthetic.face import face_layout
from tests.synthetic.rom import neutral_take, person, range_of_motion, rough

if TYPE_CHECKING:
    from click.testing import Result

    from retarget.rig.model import Rig

ROOT = Path(__file__).parents[2]
EXPRESSIONS = ["jawOpen", "smile", "browsUp"]


@pytest.fixture(scope="module")
def takes(human: Rig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with neutral.c3d, rom.c3d, and moving.c3d, which never rests."""
    rng = np.random.default_rng(17)
    face = person(human, face_layout(), rng)
    folder = tmp_path_factory.mktemp("takes")
    write_c3d(rough(neutral_take(face, rng), rng), folder / "neutral.c3d")
    write_c3d(rough(range_of_motion(face, rng, only=EXPRESSIONS), rng), folder / "rom.c3d")
    moving = neutral_take(face, rng)
    moving.p_world[:] += rng.normal(scale=0.006, size=moving.p_world.shape)
    write_c3d(moving, folder / "moving.c3d")
    return folder


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["performer", *map(str, arguments)])


def failure(*arguments: str | Path) -> str:
    result = run(*arguments)
    assert result.exit_code == 1, result.output
    said = result.output.splitlines()
    assert not any(line.startswith(("Traceback", "  File")) for line in said)
    return str(said[-1])


def test_takes_become_a_performer_file_and_a_table_of_about_ten_lines(takes: Path, tmp_path: Path) -> None:
    out = tmp_path / "ana.toml"
    result = run("--neutral", takes / "neutral.c3d", "--rom", takes / "rom.c3d", "-o", out)
    assert result.exit_code == 0, result.output
    performer = load_performer(out)
    assert performer.name == "ana"
    assert performer.layout == "face24"
    table = result.output.split("- ")[0]
    assert 8 <= table.count("\n") <= 13
    assert "jaw opens" in table
    assert "The lips never puckered." in result.output


def test_several_takes_follow_one_option(takes: Path, tmp_path: Path) -> None:
    rom = takes / "rom.c3d"
    result = run("--rom", rom, rom, "--neutral", takes / "neutral.c3d", "-o", tmp_path / "a.toml", "--json")
    assert result.exit_code == 0, result.output
    assert [take["name"] for take in json.loads(result.output)["takes"]] == ["rom.c3d", "rom.c3d"]


def test_a_value_fixed_in_the_file_outlives_a_new_calibration(takes: Path, tmp_path: Path) -> None:
    out = tmp_path / "ana.toml"
    arguments = ("--neutral", takes / "neutral.c3d", "--rom", takes / "rom.c3d", "-o", out)
    assert run(*arguments).exit_code == 0
    text = out.read_text()
    text = re.sub(r"(?m)^lipUpper = .*$", "lipUpper = 0.111", text, count=1)  # the first is that in [K]
    out.write_text(text.replace("markers = [", 'fixed = ["K.lipUpper"]\nmarkers = [', 1))
    assert run(*arguments).exit_code == 0
    performer = load_performer(out)
    np.testing.assert_allclose(performer.K["lipUpper"], 0.111 * np.eye(3))
    assert performer.fixed == ("K.lipUpper",)


class _Links(html.parser.HTMLParser):
    """Everything that a page would fetch, and whether its elements are closed."""

    VOID = ("meta", "img", "link", "br", "path", "circle", "rect", "polyline")

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.fetched += [value or "" for name, value in attrs if name in ("src", "href") and tag != "a"]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in self.VOID:
            assert self.open.pop() == tag


def test_the_report_is_one_page_that_fetches_nothing(takes: Path, tmp_path: Path) -> None:
    report = tmp_path / "ana.html"
    arguments = ("--neutral", takes / "neutral.c3d", "--rom", takes / "rom.c3d", "-o", tmp_path / "<i>.toml")
    assert run(*arguments, "--report", report).exit_code == 0
    text = report.read_text("utf-8")
    page = _Links()
    page.feed(text)
    assert page.open == []
    assert all(link.startswith("data:image/png;base64,") for link in page.fetched)
    assert "url(" not in text
    assert "<script" not in text
    assert "&lt;i&gt; on human" in text
    assert "nan" not in re.sub(r"base64,[^\"]*", "", text)
    for heading in ("Findings", "Extremes, before and after", "Jaw", "On what it did not see", "Sites", "Markers"):
        assert f"<h2>{heading}</h2>" in text


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--neutral", "moving.c3d", "--rom", "rom.c3d"), "no still stretch"),
        (("--neutral", "neutral.c3d", "--rom", "nothing.c3d"), "no file"),
        (("--neutral", "neutral.c3d", "--rom", "rom.c3d", "--bounds", "1", "0.25"), "bounds of K cross"),
        (("--neutral", "neutral.c3d", "--rom", "rom.c3d", "--rig", "nobody"), "nobody"),
        (("--neutral", "neutral.c3d", "--rom", "rom.c3d", "--layout", "animface41"), "Head markers are missing"),
        (("--rom", "natnet://127.0.0.1"), "--from natnet"),
        (("--neutral", "neutral.c3d", "--rom", "rom.c3d", "--poses", "rom.c3d"), "neither"),
    ],
)
def test_what_cannot_be_calibrated_is_told_in_one_sentence(
    takes: Path, tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    placed = [str(takes / a) if a.endswith(".c3d") else a for a in arguments]
    assert words in failure(*placed, "-o", tmp_path / "x.toml")
    assert not (tmp_path / "x.toml").exists()


def test_a_take_with_two_head_markers_is_refused_by_their_names(human: Rig, takes: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    take = neutral_take(person(human, face_layout(), rng), rng)
    take.p_world[:, :2] = np.nan
    write_c3d(take, tmp_path / "blind.c3d")
    said = failure("--neutral", tmp_path / "blind.c3d", "--rom", takes / "rom.c3d", "-o", tmp_path / "x.toml")
    assert "Head markers are missing in blind.c3d" in said


def test_a_short_take_is_refused(human: Rig, takes: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    write_c3d(neutral_take(person(human, face_layout(), rng), rng, seconds=0.4), tmp_path / "short.c3d")
    arguments = ("--neutral", takes / "neutral.c3d", "--rom", tmp_path / "short.c3d", "-o", tmp_path / "x.toml")
    assert "too short for a range of motion" in failure(*arguments)


def test_a_layout_that_shares_no_sites_with_the_rig_is_refused(takes: Path, tmp_path: Path) -> None:
    lines = [f'{name} = {{ site = "elsewhere{i}" }}' for i, name in enumerate(("chin", "lipUpper", "noseBridge"))]
    lines += [f"{name} = {{ head = true }}" for name in ("headFrontLeft", "headFrontRight", "headBackLeft")]
    (tmp_path / "mine.toml").write_text("\n".join(['version = 1\nname = "mine"\n[markers]', *lines]))
    arguments = ("--neutral", takes / "neutral.c3d", "--rom", takes / "rom.c3d", "--layout", tmp_path / "mine.toml")
    assert "sites of the rig" in failure(*arguments, "-o", tmp_path / "x.toml")


def test_an_output_with_a_mistake_is_not_overwritten(takes: Path, tmp_path: Path) -> None:
    out = tmp_path / "ana.toml"
    out.write_text("version = 1\nspeed = 3\n")
    said = failure("--neutral", takes / "neutral.c3d", "--rom", takes / "rom.c3d", "-o", out)
    assert "'speed' on line 2" in said
    assert out.read_text() == "version = 1\nspeed = 3\n"


@pytest.mark.parametrize(
    "arguments", [("-o", "a.toml"), ("--rom", "a.c3d", "--from", "natnet://x", "-o", "a.toml"), ("--rom", "a.c3d")]
)
def test_wrong_usage_has_status_2(arguments: tuple[str, ...]) -> None:
    assert run(*arguments).exit_code == 2


def test_the_module_answers_as_a_program_of_its_own() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "calib", "performer", "--help"], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert "--neutral" in done.stdout
