"""OpenVHead's text, against what its own client sent, glued and cut as TCP may deliver it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget.errors import ProtocolError
from retarget.udp.openvhead_message import OpenVHeadMessage, OpenVHeadStream, decode, encode

RECORDED = Path(__file__).parents[2] / "../shared/data/oracles/openvhead_carphone.json"
FINITE = st.floats(-1e6, 1e6)
MESSAGES = st.builds(OpenVHeadMessage, *[FINITE] * 11)


def message(value: float) -> OpenVHeadMessage:
    """One with the same number in every field."""
    return OpenVHeadMessage(*[value] * 11)


def recorded() -> list[str]:
    """The 117 texts that OpenVHead's client sent."""
    if not RECORDED.exists():
        pytest.skip("the recording openvhead_carphone.json is not here")
    texts: list[str] = json.loads(RECORDED.read_text())["messages"]
    return texts


def test_the_recorded_texts_are_read_and_written_again_to_the_letter() -> None:
    texts = recorded()
    assert [encode(decode(text.encode())).decode() for text in texts] == texts


def test_recorded_messages_that_tcp_glued_into_one_are_told_apart() -> None:
    texts = recorded()
    stream = OpenVHeadStream()
    messages = stream.feed("".join(texts).encode()) + stream.flush()
    assert [encode(each).decode() for each in messages] == texts


@pytest.mark.parametrize("size", [1, 7, 100, 181, 1024])
def test_recorded_messages_that_tcp_cut_anywhere_are_put_together(size: int) -> None:
    texts = recorded()
    whole = "".join(texts).encode()
    stream = OpenVHeadStream()
    messages = [each for at in range(0, len(whole), size) for each in stream.feed(whole[at : at + size])]
    assert [encode(each).decode() for each in messages + stream.flush()] == texts


def test_two_positive_numbers_that_touch_are_cut_where_the_head_moves_least() -> None:
    first = message(0.5)._replace(tx=5539.92, mouth_length=0.3415965106239475)
    second = first._replace(tx=5540.01)
    glued = encode(first) + encode(second) + encode(second)
    stream = OpenVHeadStream()
    stream.feed(encode(first))
    stream.flush()
    assert stream.feed(glued) + stream.flush() == [first, second, second]


def test_an_edge_of_what_tcp_delivered_tells_where_numbers_touch() -> None:
    first = message(1.5)._replace(mouth_length=0.34)
    second = message(1.5)._replace(tx=12.5)
    stream = OpenVHeadStream()
    assert stream.feed(encode(first)) == []
    assert stream.feed(encode(second)) == [first]
    assert stream.flush() == [second]


@given(st.lists(MESSAGES, min_size=1, max_size=5), st.data())
def test_with_newlines_any_numbers_survive_any_cut(messages: list[OpenVHeadMessage], data: st.DataObject) -> None:
    whole = b"".join(encode(each) + b"\n" for each in messages)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(whole)), max_size=6)))
    stream = OpenVHeadStream()
    parts = [whole[a:b] for a, b in zip([0, *cuts], [*cuts, len(whole)], strict=True)]
    assert [each for part in parts for each in stream.feed(part)] == messages


def test_what_is_not_a_number_is_kept_as_nan() -> None:
    assert all(math.isnan(value) for value in decode(encode(message(math.nan))))


def test_eof_ends_the_stream_and_what_follows_is_not_read() -> None:
    ones = message(1.0)
    stream = OpenVHeadStream()
    assert stream.feed(encode(ones) + b"<EOF>" + encode(ones)) + stream.flush() == [ones]
    assert stream.ended


@given(st.binary(max_size=2000))
def test_hostile_bytes_end_in_protocol_error_and_nothing_else(payload: bytes) -> None:
    stream = OpenVHeadStream()
    for part in (payload, payload, b":" * 30):
        try:
            stream.feed(part)
            stream.flush()
        except ProtocolError:
            continue
    assert len(stream._text) < 1000


@pytest.mark.parametrize(
    "text", ["", "1:2", ":".join(["1.0"] * 12), ":".join(["x"] * 11), ":".join(["1_0"] * 11), ":".join(["9" * 40] * 11)]
)
def test_what_is_not_eleven_numbers_is_refused(text: str) -> None:
    with pytest.raises(ProtocolError):
        decode(text.encode())
