"""`python -m tests.camera.fetch`: all models and the clip, so that no test of the camera is skipped."""

from __future__ import annotations

from retarget.camera import models
from tests.camera.clips import CARPHONE


def main() -> None:
    """Fetch what is not here yet."""
    for card in models.cards():
        models.fetch(card.name, print)
    if models.state(CARPHONE) != "ready":
        models.fetch_cards((CARPHONE,), print)


if __name__ == "__main__":
    main()
