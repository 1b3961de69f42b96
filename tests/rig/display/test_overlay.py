"""Words on a picture touch their panel and nothing else."""

from __future__ import annotations

import numpy as np

from retarget.rig.display.overlay import with_text


def test_words_stand_on_a_panel_in_the_upper_left_corner() -> None:
    picture = np.full((240, 320, 3), (0, 255, 0), np.uint8)
    told = with_text(picture, "frozen")
    changed = (told != picture).any(axis=-1)
    assert 500 < changed.sum() < 320 * 240 / 4
    assert not changed[120:].any()
    assert not changed[:, 160:].any()
    assert (told == 255).all(axis=-1).sum() > 20
    assert (picture == (0, 255, 0)).all()  # the picture itself, which may be saved, stays clean


def test_more_lines_take_more_room() -> None:
    picture = np.zeros((240, 320, 3), np.uint8) + np.uint8(100)
    heights = [np.nonzero((with_text(picture, text) != 100).any(axis=(1, 2)))[0].max() for text in ("a", "a\nb\nc")]
    assert heights[1] > heights[0] + 20


def test_a_picture_smaller_than_the_words_keeps_its_size() -> None:
    assert with_text(np.zeros((16, 16, 3), np.uint8), "far too long\n" * 9).shape == (16, 16, 3)
