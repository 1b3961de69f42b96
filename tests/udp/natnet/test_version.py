"""Bitstream versions, and what each carries."""

from __future__ import annotations

import pytest

from retarget.errors import ProtocolError
from retarget.udp.natnet.version import (
    LATEST,
    OLDEST,
    Bitstream,
    PrecisionForm,
    TimestampForm,
    layout_of,
    parse_bitstream,
)


@pytest.mark.parametrize(
    ("text", "version"), [("4.1", (4, 1)), (" 2.10 ", (2, 10)), ("3.0.0.0", (3, 0)), ("4.3", (4, 3))]
)
def test_versions_are_read_as_people_and_servers_write_them(text: str, version: tuple[int, int]) -> None:
    assert parse_bitstream(text) == version


@pytest.mark.parametrize("text", ["", "4", "four.one", "4.", ".1", "-4.1", "4.x", "٤.١", "9" * 40 + ".1"])
def test_what_is_no_version_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(ProtocolError, match=r"such as 4\.3"):
        parse_bitstream(text)


@pytest.mark.parametrize("version", [Bitstream(2, 4), Bitstream(4, 4), Bitstream(0, 0), Bitstream(255, 255)])
def test_a_version_that_is_not_known_is_refused_with_those_that_are(version: Bitstream) -> None:
    with pytest.raises(ProtocolError, match=r"2\.5 to 4\.3"):
        layout_of(version)


def test_minor_versions_are_numbers_and_not_decimals() -> None:
    assert Bitstream(2, 9) < Bitstream(2, 10) < Bitstream(3, 0)
    assert str(Bitstream(2, 10)) == "2.10"
    assert (OLDEST, LATEST) == ((2, 5), (4, 3))


@pytest.mark.parametrize(
    ("feature", "first"),
    [
        ("params", (2, 6)),
        ("force_plates", (2, 9)),
        ("devices", (2, 11)),
        ("ticks", (3, 0)),
        ("residual", (3, 0)),
        ("described_markers", (3, 0)),
        ("described_marker_names", (4, 0)),
        ("assets", (4, 1)),
        ("section_sizes", (4, 1)),
        ("described_rotation", (4, 2)),
    ],
)
def test_what_a_version_brought_later_versions_keep(feature: str, first: tuple[int, int]) -> None:
    for version in (
        Bitstream(2, 5),
        Bitstream(2, 9),
        Bitstream(2, 11),
        *(Bitstream(m, n) for m in (3, 4) for n in (0, 1)),
    ):
        assert getattr(layout_of(version), feature) == (version >= first)


def test_what_3_0_took_away_is_gone() -> None:
    for version in (Bitstream(2, 11), Bitstream(3, 0)):
        layout = layout_of(version)
        assert layout.software_latency == layout.rigid_body_markers == (version < (3, 0))


def test_time_stamps_grew_over_the_versions() -> None:
    forms = [layout_of(Bitstream(2, minor)).timestamp for minor in (5, 6, 7)]
    assert forms == [TimestampForm.ABSENT, TimestampForm.FLOAT32, TimestampForm.FLOAT64]
    precise = [layout_of(Bitstream(*v)).precision for v in ((3, 1), (4, 0), (4, 1))]
    assert precise == [PrecisionForm.ABSENT, PrecisionForm.EITHER, PrecisionForm.PRESENT]
