"""The datagrams of points: independent bytes, round trips, hostile input."""

from __future__ import annotations

import hashlib
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from retarget.errors import InputError, ProtocolError
from retarget.frames import MarkerLayout
from retarget.udp.landmarks import (
    LayoutMessage,
    PointsMessage,
    decode,
    encode_layout,
    encode_points,
    is_points,
    layout_id,
)

LAYOUT = MarkerLayout("two", ("nose", "größe"))
NAMES = st.lists(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), min_size=1, max_size=20),
                 min_size=1, max_size=30, unique=True)  # fmt: skip


def points(count: int = 2) -> PointsMessage:
    return PointsMessage(layout_id(LAYOUT.name, LAYOUT.names), 7, 42, 1.5, 0.75, np.arange(3.0 * count).reshape(-1, 3))


def test_points_are_the_documented_bytes() -> None:
    number = int.from_bytes(hashlib.sha256("two\0nose\0größe\0".encode()).digest()[:8], "little")
    by_hand = b"RTLM" + bytes([1, 2]) + struct.pack("<HQ", 2, number)
    by_hand += struct.pack("<IQdf", 7, 42, 1.5, 0.75) + struct.pack("<6f", 0, 1, 2, 3, 4, 5)
    assert encode_points(points()) == by_hand


def test_a_layout_is_the_documented_bytes() -> None:
    number = int.from_bytes(hashlib.sha256("two\0nose\0größe\0".encode()).digest()[:8], "little")
    by_hand = b"RTLM" + bytes([1, 1]) + struct.pack("<HQ", 2, number) + b"\x03two\x04nose\x07" + "größe".encode()
    assert encode_layout(LAYOUT) == by_hand


@given(NAMES)
def test_any_names_come_back(names: list[str]) -> None:
    message = decode(encode_layout(MarkerLayout("any", tuple(names))))
    assert isinstance(message, LayoutMessage)
    assert (message.layout.name, list(message.layout.names)) == ("any", names)
    assert message.layout_id == layout_id("any", names)


@given(
    arrays(np.float32, st.tuples(st.integers(1, 50), st.just(3)), elements=st.floats(-100, 100, width=32)),
    st.integers(0, 2**32 - 1),
    st.integers(0, 2**64 - 1),
    st.floats(-1e9, 1e9),
)
def test_any_points_come_back(positions: np.ndarray, session: int, sequence: int, time_s: float) -> None:
    sent = PointsMessage(1, session, sequence, time_s, 1.0, positions.astype(float))
    message = decode(encode_points(sent))
    assert isinstance(message, PointsMessage)
    assert (message.session, message.sequence, message.time_s) == (session, sequence, time_s)
    np.testing.assert_array_equal(message.positions, sent.positions)


def test_a_point_that_is_not_seen_is_a_row_of_nan() -> None:
    sent = points()
    sent.positions[1, 2] = np.nan
    message = decode(encode_points(sent))
    assert isinstance(message, PointsMessage)
    assert np.isnan(message.positions[1]).all()
    assert np.isfinite(message.positions[0]).all()


@pytest.mark.parametrize("whole", [encode_points(points()), encode_layout(LAYOUT)])
def test_cut_at_every_byte_it_raises_protocol_error_and_nothing_else(whole: bytes) -> None:
    for end in range(len(whole)):
        with pytest.raises(ProtocolError):
            decode(whole[:end])
    with pytest.raises(ProtocolError):
        decode(whole + b"\0")


@given(st.sampled_from([encode_points(points()), encode_layout(LAYOUT)]), st.data())
def test_changed_bytes_decode_or_raise_protocol_error(whole: bytes, data: st.DataObject) -> None:
    changed = bytearray(whole)
    for at in data.draw(st.lists(st.integers(0, len(whole) - 1), min_size=1, max_size=4)):
        changed[at] = data.draw(st.integers(0, 255))
    try:
        message = decode(bytes(changed))
    except ProtocolError:
        return
    if isinstance(message, PointsMessage):
        assert not np.isinf(message.positions).any()
        assert 0 <= message.confidence <= 1


def test_a_layout_whose_number_is_not_that_of_its_names_is_refused() -> None:
    whole = bytearray(encode_layout(LAYOUT))
    whole[-1:] = b"E"
    with pytest.raises(ProtocolError, match="number that its names give"):
        decode(bytes(whole))


@pytest.mark.parametrize("confidence", [-0.1, 1.1, float("nan"), float("inf")])
def test_an_impossible_confidence_is_refused(confidence: float) -> None:
    message = points()
    sent = PointsMessage(message.layout_id, 0, 0, 0.0, confidence, message.positions)
    with pytest.raises(ProtocolError, match="confidence"):
        decode(encode_points(sent))


@pytest.mark.parametrize(
    "layout",
    [
        MarkerLayout("none", ()),
        MarkerLayout("long", ("x" * 256,)),
        MarkerLayout("many", tuple(f"{i}" for i in range(4097))),
        MarkerLayout("big", tuple(f"{i:0250}" for i in range(300))),
    ],
)
def test_a_layout_that_no_datagram_holds_is_refused(layout: MarkerLayout) -> None:
    with pytest.raises(InputError):
        encode_layout(layout)


def test_only_points_count_as_frames_for_the_queue() -> None:
    assert is_points(encode_points(points()))
    assert not is_points(encode_layout(LAYOUT))
    assert not is_points(b"RTLM")
