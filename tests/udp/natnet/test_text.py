"""Names: UTF-8 where they are UTF-8, and every other byte kept."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from retarget.errors import InputError
from retarget.udp.natnet.text import octets_from_text, terminated, text_from_octets


@given(st.binary())
@example("é".encode("latin-1"))
@example("\uef80 and \uefff".encode())
@example("\uef80".encode() + b"\xff")
def test_any_bytes_become_text_that_gives_the_same_bytes(octets: bytes) -> None:
    text = text_from_octets(octets)
    assert octets_from_text(text) == octets
    text.encode("utf-8")


@given(st.text(st.characters(exclude_categories=["Cs", "Co"])))
def test_text_is_plain_utf_8_on_the_wire(text: str) -> None:
    assert octets_from_text(text) == text.encode("utf-8")
    assert text_from_octets(text.encode("utf-8")) == text


@given(st.binary(), st.binary())
def test_different_bytes_never_become_the_same_text(one: bytes, other: bytes) -> None:
    assert (text_from_octets(one) == text_from_octets(other)) == (one == other)


def test_a_foreign_byte_is_shown_as_one_private_character() -> None:
    assert text_from_octets(b"Z\xfcrich") == "Z\ueffcrich"


def test_a_name_cannot_hold_what_ends_it() -> None:
    assert terminated("chin") == b"chin\0"
    with pytest.raises(InputError, match="NUL"):
        terminated("ch\0in")


def test_a_lone_surrogate_cannot_be_written() -> None:
    for text in ("\ud800", "\uef80\ud800"):
        with pytest.raises(InputError, match="UTF-8"):
            octets_from_text(text)
