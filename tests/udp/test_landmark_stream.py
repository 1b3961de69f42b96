"""Order, names and time of a stream of points, without a socket."""

from __future__ import annotations

import numpy as np
import pytest

from retarget.frames import MarkerLayout
from retarget.udp.landmark_stream import LandmarkStream, OneWayClock
from retarget.udp.landmarks import PointsMessage, encode_layout, encode_points, layout_id

LAYOUT = MarkerLayout("two", ("nose", "chin"))
NAMES = encode_layout(LAYOUT)


def payload(sequence: int, time_s: float = 0.0, session: int = 1) -> bytes:
    return encode_points(PointsMessage(layout_id("two", LAYOUT.names), session, sequence, time_s, 1.0, np.ones((2, 3))))


def test_points_before_their_names_are_counted_and_not_used() -> None:
    stream = LandmarkStream()
    assert stream.receive(payload(0), 1.0) is None
    stream.receive(NAMES, 1.0)
    frame = stream.receive(payload(1), 1.0)
    assert frame is not None
    assert frame.layout.names == LAYOUT.names
    assert (stream.received, stream.unnamed) == (1, 1)


def test_doubled_late_and_lost_points_are_told_apart() -> None:
    stream = LandmarkStream()
    stream.receive(NAMES, 0.0)
    used = [stream.receive(payload(sequence), 0.0) is not None for sequence in (0, 1, 1, 4, 3, 5)]
    assert used == [True, True, False, True, False, True]
    assert (stream.doubled, stream.late, stream.lost) == (1, 1, 1)


def test_a_sender_that_starts_again_is_followed_at_once() -> None:
    stream = LandmarkStream()
    stream.receive(NAMES, 0.0)
    stream.receive(payload(500, 100.0), 1.0)
    frame = stream.receive(payload(0, 0.0, session=2), 2.0)
    assert frame is not None
    assert frame.time_s == pytest.approx(2.0)
    assert stream.lost == 0


def test_layouts_keep_their_identity_from_frame_to_frame() -> None:
    stream = LandmarkStream()
    layouts = []
    for sequence in range(3):
        stream.receive(NAMES, 0.0)
        frame = stream.receive(payload(sequence), 0.0)
        assert frame is not None
        layouts.append(frame.layout)
    assert layouts[0] is layouts[1] is layouts[2]


def test_what_is_no_datagram_of_points_is_counted() -> None:
    stream = LandmarkStream()
    assert stream.receive(b"RTLM but not really", 0.0) is None
    assert stream.malformed == 1


def test_the_clock_follows_the_sender_in_spite_of_late_datagrams() -> None:
    rng = np.random.default_rng(5)
    clock = OneWayClock()
    sent = np.arange(3000) / 60
    delays = 0.002 + rng.exponential(0.005, sent.size)
    heard = 1000 + sent * (1 + 5e-5) + delays  # clocks that run apart by 50 parts in a million
    local = np.array([clock.local(s, r) for s, r in zip(sent.tolist(), heard.tolist(), strict=True)])
    error = local - (1000 + sent * (1 + 5e-5) + 0.002)
    assert np.abs(error[200:]).max() < 0.004
    assert np.diff(local).min() > 0.5 / 60
    assert (local <= heard + 1e-9).all()
