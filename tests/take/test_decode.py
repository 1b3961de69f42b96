"""Frames out of takes: the vendor's own client is the witness for the real session."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.take.convert import write_take
from retarget.take.decode import TakeFrames, clip_of, frames
from retarget.take.metadata import TakeMetadata
from retarget.take.reader import read_take
from retarget.udp.datagram import Datagram
from retarget.udp.natnet.messages import MessageId
from tests.take.sessions import SESSION, made_up, motive_session

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from retarget.take.reader import Take


def without(tmp_path: Path, unwanted: Callable[[Datagram], bool]) -> Take:
    """The real session, recorded again without some of its datagrams."""
    session = read_take(motive_session())
    path = tmp_path / "part.mcap"
    write_take(path, (d for d in session if not unwanted(d)), session.metadata)
    return read_take(path)


def is_kind(datagram: Datagram, *kinds: MessageId) -> bool:
    return datagram.payload[0] in kinds


def printed_by_the_vendors_client() -> dict[int, list[tuple[int, list[float]]]]:
    """(member number, position [m, two decimals]) of every asset marker, by frame number."""
    text = SESSION.with_name("motive-2.1_natnet-3.0_vendor-client-output.txt").read_text()
    printed: dict[int, list[tuple[int, list[float]]]] = {}
    for line in text.splitlines():
        if line.startswith("FrameID : "):
            latest = printed.setdefault(int(line.removeprefix("FrameID : ")), [])
        elif marker := re.search(r"ModelID=2, MarkerID=(\d), Occluded=0.*pos=(.*)\]", line):
            latest.append((int(marker[1]), [float(value) for value in marker[2].split(",")]))
    return printed


def test_frames_of_the_real_session_agree_with_what_the_vendors_client_printed() -> None:
    found = {frame.number: frame for frame in frames(read_take(motive_session()))}
    printed = printed_by_the_vendors_client()
    assert len(printed) > 200
    for number, markers in printed.items():
        frame = found[number]
        for member, position in markers:
            row = frame.layout.names.index(f"Marker{member}")
            np.testing.assert_allclose(frame.positions[row], position, atol=0.00501)


def test_same_take_gives_the_same_frames_bit_for_bit(tmp_path: Path) -> None:
    take = without(tmp_path, lambda _: False)
    source = TakeFrames(take)
    for again in (source, TakeFrames(read_take(take.path))):
        for a, b in zip(source, again, strict=True):
            assert (a.number, a.time_s, a.received_s) == (b.number, b.time_s, b.received_s)
            assert a.positions.tobytes() == b.positions.tobytes()


def test_first_frame_has_names_though_the_definitions_came_later() -> None:
    take = read_take(motive_session())
    kinds = [d.payload[0] for d in take]
    assert kinds.index(MessageId.MODELDEF) > kinds.index(MessageId.FRAMEOFDATA)
    assert next(frames(take)).layout.names[0] == "Marker1"


def test_capture_that_began_in_the_middle_of_a_session_is_read_with_a_guessed_bitstream(tmp_path: Path) -> None:
    take = without(tmp_path, lambda d: d.channel == "command")
    source = TakeFrames(take)
    found, whole = list(source), list(frames(read_take(motive_session())))
    assert len(found) == 518
    for a, b in zip(found, whole, strict=True):
        np.testing.assert_array_equal(np.sort(a.positions, axis=0), np.sort(b.positions, axis=0))


def test_lost_frames_are_counted_and_nothing_is_seen_in_them(tmp_path: Path) -> None:
    lost = set(range(100, 140))
    numbers = {(162734 + i).to_bytes(4, "little") for i in lost}
    take = without(tmp_path, lambda d: d.payload[:2] == b"\7\0" and d.payload[4:8] in numbers)
    source = TakeFrames(take)
    assert len(list(source)) == 478
    assert source.session.framing.lost == 40
    clip = clip_of(take)
    assert clip.positions.shape == (518, 5, 3)
    assert {i for i, p in enumerate(clip.positions) if np.isnan(p).all()} == lost
    assert clip.notes[0] == "40 frames were lost; nothing is seen in them."
    assert (clip.rate_hz, clip.first_frame) == (120.0, 162734)


def test_rate_comes_from_the_time_stamps_where_the_server_does_not_say(tmp_path: Path) -> None:
    take = without(tmp_path, lambda d: is_kind(d, MessageId.REQUEST, MessageId.RESPONSE))
    assert clip_of(take).rate_hz == pytest.approx(120.0, abs=0.1)


def test_frames_that_start_over_are_taken_one_after_another(tmp_path: Path) -> None:
    session = read_take(motive_session())
    first, path = list(session), tmp_path / "twice.mcap"
    again = [replace(d, received_s=d.received_s + 7.0) for d in first if d.channel == "data"]
    write_take(path, [*first, *again], TakeMetadata())
    clip = clip_of(read_take(path))
    assert len(clip) == 2 * 518
    assert "jump" in clip.notes[0]
    np.testing.assert_array_equal(clip.positions[:518], clip.positions[518:])


def test_second_server_is_left_out_with_a_word(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    session, path = list(read_take(motive_session())), tmp_path / "two.mcap"
    second = [replace(d, peer=("192.168.0.77", d.peer[1])) for d in session]
    both = sorted([*session, *second], key=lambda d: d.received_s)
    write_take(path, both, TakeMetadata())
    assert len(list(frames(read_take(path)))) == 518
    assert caplog.text.count("those of 192.168.0.77 not") == 1


def test_take_without_frames_and_take_of_nonsense_are_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "commands.mcap"
    write_take(path, [Datagram(0.0, "out", "command", ("10.0.0.7", 1510), b"\x0a\0\0\0")], TakeMetadata())
    with pytest.raises(InputError, match="no frame of marker data"):
        frames(read_take(path))
    nonsense = [replace(d, payload=b"\7\0" + d.payload) for d in made_up(100) if d.direction == "in"]
    write_take(tmp_path / "nonsense.mcap", nonsense, TakeMetadata())
    with pytest.raises(InputError, match="make no sense in any bitstream"):
        frames(read_take(tmp_path / "nonsense.mcap"))
