"""The labeller: a naive lookup by name beside it, reports, and streams that change their names."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.frames import MarkerFrame
from retarget.markers import Labeller, load_layout, read_c3d
from tests.markers.takes import HEADBAND, JAW, frame, layout, recording

if TYPE_CHECKING:
    from pathlib import Path

LAYOUT = load_layout("face24")


def test_markers_of_a_real_take_stand_under_the_layouts_names() -> None:
    clip = read_c3d(recording(JAW))
    target = load_layout("animface41")
    labelled = Labeller(target)(clip.frame(7))
    assert labelled.layout is target.markers
    for name, place in zip(target.markers.names, labelled.positions, strict=True):
        source = next(i for i, n in enumerate(clip.layout.names) if n.lower() == name.lower())
        np.testing.assert_array_equal(place, clip.positions[7, source])
    assert (labelled.number, labelled.time_s, labelled.unlabelled) == (7, 7 / 60, None)


def test_what_the_layout_does_not_know_is_kept_as_unlabelled_points_and_reported_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    clip = read_c3d(recording(HEADBAND))
    labeller = Labeller(LAYOUT)
    with caplog.at_level(logging.WARNING, "retarget.markers"):
        labelled = [labeller(clip.frame(i)) for i in range(3)]
    assert len(caplog.records) == 2
    assert all(name in caplog.records[0].getMessage() for name in labeller.unmatched)
    assert "lipCornerLeft" in caplog.records[1].getMessage()
    assert len(labeller.unmatched) == len(clip.layout.names) - 4
    assert set(labeller.missing) == {name for name in LAYOUT.markers.names if not name.startswith("head")}
    seen, known = (np.isfinite(positions).all(-1).sum() for positions in (clip.positions[0], labelled[0].positions))
    assert labelled[0].unlabelled is not None
    assert 0 < known <= 4
    assert len(labelled[0].unlabelled) == seen - known
    assert np.isnan(labelled[0].positions[4:]).all()


def test_points_without_a_name_stay_behind_those_of_an_unknown_name() -> None:
    stray = np.array([[9.0, 9, 9]])
    incoming = MarkerFrame(0, 0, 0, layout("chin", "other", "gone"), np.diag([1.0, 2, np.nan]), None, stray)
    labelled = Labeller(LAYOUT)(incoming)
    np.testing.assert_array_equal(labelled.unlabelled, [[0, 2, 0], [9, 9, 9]])


def test_a_frame_in_the_layout_already_passes_as_it_is() -> None:
    labelled = Labeller(LAYOUT)(frame(np.ones((1, 3)), markers=layout("chin")))
    assert Labeller(LAYOUT)(labelled) is labelled


def test_no_known_marker_is_an_error_with_the_names_seen_and_expected() -> None:
    with pytest.raises(InputError, match=r"Seen: a, b\. Expected: face24: headFrontLeft") as caught:
        Labeller(LAYOUT)(frame(np.ones((2, 3)), markers=layout("a", "b")))
    assert "chin" in str(caught.value)


def test_a_stream_may_change_its_names_and_lose_them_all_for_a_while() -> None:
    labeller = Labeller(LAYOUT)
    chin = LAYOUT.markers.names.index("chin")
    labeller(frame([[1, 1, 1], [2, 2, 2]], markers=layout("chin", "x")))
    np.testing.assert_array_equal(
        labeller(frame([[1, 1, 1], [2, 2, 2]], markers=layout("x", "chin"))).positions[chin], [2, 2, 2]
    )
    for lost in (layout("x"), layout()):
        gone = labeller(frame(np.ones((len(lost.names), 3)), markers=lost))
        assert gone.positions.shape == (24, 3)
        assert np.isnan(gone.positions).all()
    assert labeller(frame([[3, 3, 3]], markers=layout("chin"))).positions[chin, 0] == 3


def test_a_repeated_description_with_the_same_names_is_reported_once(caplog: pytest.LogCaptureFixture) -> None:
    labeller = Labeller(LAYOUT)
    with caplog.at_level(logging.WARNING, "retarget.markers"):
        for _ in range(3):
            labeller(frame(np.ones((2, 3)), markers=layout("chin", "x")))
    assert len(caplog.records) == 2


def test_after_a_reset_a_source_without_known_markers_is_an_error_again() -> None:
    labeller = Labeller(LAYOUT)
    labeller(frame(np.ones((1, 3)), markers=layout("chin")))
    labeller.reset()
    with pytest.raises(InputError):
        labeller(frame(np.ones((1, 3)), markers=layout("x")))


def test_a_users_layout_takes_part_of_a_take(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    heads = "\n".join(f"{name} = {{ head = true }}" for name in "abc")
    path.write_text(f'version = 1\nname = "mine"\n[markers]\nkinn = {{ site = "chin", aliases = ["Chin"] }}\n{heads}')
    clip = read_c3d(recording(JAW))
    labelled = Labeller(load_layout(path))(clip.frame(0))
    np.testing.assert_array_equal(labelled.positions[0], clip.positions[0, clip.layout.names.index("Chin")])
