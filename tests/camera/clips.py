"""The talking head that tests and the demo look at, and the models they look with; tests skip where they are absent."""

from __future__ import annotations

from pathlib import Path

import pytest

from retarget.camera import models

CARPHONE = models.read_card(Path(__file__).with_name("carphone.toml"))


def carphone() -> Path:
    """The clip; skips the test where nobody has fetched it."""
    if models.state(CARPHONE) != "ready":
        pytest.skip("the clip carphone is not here; fetch it with `python -m tests.camera.fetch`")
    return CARPHONE.path


def need(*names: str) -> None:
    """Skip the test where one of the models is not here."""
    for card, state in models.available():
        if card.name in names and state != "ready":
            pytest.skip(f"the model {card.name} is not here; fetch it with `python -m tests.camera.fetch`")
