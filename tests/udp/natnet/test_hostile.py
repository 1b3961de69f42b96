"""Bytes of bad will: cut, bent, announcing more than they bring. They are refused, or read for what they say."""

from __future__ import annotations

import tracemalloc
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from retarget.errors import ProtocolError
from retarget.udp.natnet.codec import HEADER, decode, encode
from retarget.udp.natnet.version import Bitstream
from tests.udp.natnet.beliefs import counts_and_sizes, our_verdicts, peer_verdicts
from tests.udp.natnet.captures import SESSION_VERSION, needs_captures, of_session, single_datagrams
from tests.udp.natnet.examples import every_command, face_frame, rich_frame, rich_models
from tests.udp.natnet.mutate import run
from tests.udp.natnet.strategies import EXTREMES, VERSIONS

if TYPE_CHECKING:
    from retarget.udp.natnet.messages import Message

by_version = pytest.mark.parametrize("version", VERSIONS, ids=str)
LARGEST = 65507


def assert_refused_at_every_cut(datagram: bytes, version: Bitstream) -> None:
    for length in range(len(datagram)):
        with pytest.raises(ProtocolError):
            decode(datagram[:length], version)


@by_version
def test_a_frame_cut_at_any_byte_is_refused(version: Bitstream) -> None:
    assert_refused_at_every_cut(encode(rich_frame(version), version), version)


@by_version
def test_a_model_definition_cut_at_any_byte_is_refused(version: Bitstream) -> None:
    assert_refused_at_every_cut(encode(rich_models(version), version), version)


@needs_captures
def test_real_datagrams_cut_at_any_byte_are_refused() -> None:
    assert_refused_at_every_cut(of_session(7)[0], SESSION_VERSION)
    assert_refused_at_every_cut(of_session(5)[0], SESSION_VERSION)
    for name, version, datagram in single_datagrams():
        if not name.endswith("_000.bin"):
            assert_refused_at_every_cut(datagram, version)


@pytest.mark.parametrize("command", every_command(), ids=lambda c: type(c).__name__)
def test_a_command_cut_at_any_byte_is_refused_or_is_a_shorter_command(command: Message) -> None:
    datagram = encode(command)
    for length in range(len(datagram)):
        try:
            shorter = decode(datagram[:length])
        except ProtocolError:
            continue
        assert encode(shorter)[HEADER.size :] == datagram[HEADER.size : length]


@by_version
def test_bytes_behind_the_end_are_refused(version: Bitstream) -> None:
    for message in (rich_frame(version), rich_models(version)):
        for extra in (b"\0", bytes(4), bytes(12), b"more"):
            with pytest.raises(ProtocolError):
                decode(encode(message, version) + extra, version)


@settings(max_examples=300, deadline=None)
@given(datagram=st.binary(max_size=300), version=st.sampled_from([None, *VERSIONS]))
def test_any_bytes_give_a_message_or_a_protocol_error(datagram: bytes, version: Bitstream | None) -> None:
    try:
        decode(datagram, version)
    except ProtocolError as error:
        assert str(error)  # noqa: PT017  a sentence for the user


@settings(max_examples=500, deadline=None)
@given(payload=st.binary(max_size=300), kind=st.sampled_from([5, 7]), version=st.sampled_from(VERSIONS))
def test_any_payload_of_a_frame_or_definition_is_read_or_refused(payload: bytes, kind: int, version: Bitstream) -> None:
    try:
        message = decode(HEADER.pack(kind, len(payload)) + payload, version)
    except ProtocolError:
        return
    assert encode(message, version)[HEADER.size :] == payload


def test_100_000_mutated_datagrams_are_refused_or_read_for_what_they_say() -> None:
    outcome = run(100_000, seed=11)
    assert outcome.wrong == []
    assert outcome.refused > 30_000
    assert outcome.accepted > 10_000


def peak_octets(datagram: bytes, version: Bitstream) -> int:
    """Memory that decoding asked for at its height, or that its result holds."""
    tracemalloc.start()
    try:
        message = decode(datagram, version)
        assert message is not None
    except ProtocolError:
        pass
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    return peak


@by_version
def test_a_huge_count_costs_no_memory(version: Bitstream) -> None:
    for message in (rich_frame(version), rich_models(version)):
        valid = encode(message, version)
        peak_octets(valid, version)
        for at in range(4, len(valid) - 3):
            for extreme in (EXTREMES[2], EXTREMES[6]):
                bent = valid[:at] + extreme + valid[at + 4 :]
                assert peak_octets(bent, version) < 30 * len(bent) + 20_000


def sections(*bodies: tuple[int, bytes]) -> bytes:
    """Payload of a 4.1 frame that ends after these sections: counts and bodies."""
    parts = [count.to_bytes(4, "little") + len(body).to_bytes(4, "little") + body for count, body in bodies]
    return HEADER.pack(7, 0) + bytes(4) + b"".join(parts)


EMPTY = (0, b"")


@pytest.mark.parametrize(
    "datagram",
    [
        sections((13_000, bytes(65_000))),
        sections((1000, bytes(5000))),
        sections((1000, b"\0\1\0\0\0" * 1000 + bytes(12_000))),
        sections(EMPTY, EMPTY, EMPTY, (8000, bytes(64_000))),
        sections(EMPTY, EMPTY, EMPTY, EMPTY, (5000, bytes(60_000))),
        sections(EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, (8000, bytes(64_000))),
        sections(EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, (1, bytes(4) + b"\xe8\x03\0\0" + bytes(4000))),
        HEADER.pack(5, 0) + (2000).to_bytes(4, "little") + (bytes(8) + b"\0\0\0\0\0") * 2000,
    ],
)
def test_many_empty_entries_cost_memory_in_proportion(datagram: bytes) -> None:
    assert len(datagram) < LARGEST
    peak_octets(datagram, Bitstream(4, 1))
    assert peak_octets(datagram, Bitstream(4, 1)) < 30 * len(datagram) + 20_000


@pytest.mark.parametrize("version", [v for v in VERSIONS if v >= (4, 1)], ids=str)
def test_no_frame_is_believed_whose_structure_is_certainly_wrong(version: Bitstream) -> None:
    assert our_verdicts(2000, 5, version)["believed"] == 0


def test_counts_and_sizes_are_where_the_layout_says() -> None:
    datagram = encode(face_frame(), Bitstream(4, 1))
    found = [int.from_bytes(datagram[at : at + 4], "little") for at in counts_and_sizes(datagram, Bitstream(4, 1))]
    assert found == [2, 593, 24, 24, 0, 0, 1, 38, 0, 0, 0, 0, 24, 624, 0, 0, 0, 0]


@pytest.mark.parametrize(("name", "version"), [("natnet", Bitstream(4, 1)), ("optirx", Bitstream(2, 9))])
def test_other_clients_believe_frames_that_we_refuse(name: str, version: Bitstream) -> None:
    pytest.importorskip(name)
    theirs = peer_verdicts(name, 30, 5, version)
    ours = our_verdicts(30, 5, version)
    print(f"{name} at {version}: {dict(theirs)}, ours: {dict(ours)}")
    assert ours["believed"] < theirs["believed"]
