"""Frames of the clip, told to OpenVHead's server in both styles."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from retarget.camera.ibug68 import from_mesh
from retarget.camera.landmarks import IBUG68, MESH478, Landmarks
from retarget.camera.measures import openvhead_measures
from retarget.camera.openvhead import OpenVHeadChain
from retarget.camera.openvhead_feed import SIZE, OpenVHeadFeed, Style
from retarget.errors import InputError
from retarget.frames import MarkerFrame, MarkerLayout
from retarget.udp.openvhead_message import OpenVHeadMessage
from retarget.udp.openvhead_tcp import OpenVHeadClient, OpenVHeadServer
from tests.camera import clips, oracles

RATE_HZ = 30.0


def frames() -> list[MarkerFrame]:
    """What mediapipe sees in the clip, in metres."""
    from retarget.camera.canonical import load_canonical_face
    from retarget.camera.metric import MeshDepth

    points = oracles.mediapipe()["landmarks478_px"].astype(float)
    clips.need("face_geometry")
    metres = MeshDepth(load_canonical_face(), (176, 144))
    placed = [metres(Landmarks(MESH478, each, 1.0)) for each in points]
    return [MarkerFrame(i, i / RATE_HZ, i / RATE_HZ, MESH478, each) for i, each in enumerate(placed)]


def numbers(style: Style) -> np.ndarray:
    """(120, 11)."""
    feed = OpenVHeadFeed(style)
    told = [feed(frame) for frame in frames()]
    return np.array([values.fields() for values in told if values is not None])


def test_the_virtual_camera_sees_what_the_real_one_saw() -> None:
    points = oracles.mediapipe()["landmarks478_px"].astype(float)[..., :2]
    enlarged = from_mesh((points - [88, 72]) * SIZE[0] / 176 + np.array(SIZE) / 2)
    chain = OpenVHeadChain(SIZE)
    direct = np.array([chain(np.rint(each)).fields() for each in enlarged])
    np.testing.assert_allclose(numbers("openvhead"), direct, rtol=1e-6, atol=1.01e-4)


def test_the_steady_style_neither_starts_at_zero_nor_flips_its_sign_nor_jitters() -> None:
    theirs, ours = numbers("openvhead"), numbers("steady")
    assert len(ours) == len(theirs) == 120
    assert theirs[0, 2] > 20 * np.median(theirs[:, 2])
    assert np.abs(ours[:, 2] / np.median(ours[:, 2]) - 1).max() < 0.3
    assert (np.sum(ours[1:, 3:7] * ours[:-1, 3:7], axis=1) > 0.9).all()
    assert ours[0, 4] > 0.9
    raw = np.array([openvhead_measures(from_mesh(frame.positions)[:, :2]) for frame in frames()])
    jitter = [np.median(np.abs(np.diff(values, 2, axis=0)), axis=0) for values in (ours[:, 7:], theirs[:, 7:])]
    assert (jitter[0] < 0.7 * jitter[1]).all()
    assert ours[:, 7].min() < raw[:, 0].min() + 0.06  # the blink is still one


def test_a_picture_without_a_face_is_passed_over() -> None:
    feed = OpenVHeadFeed()
    frame = frames()[0]
    lost = MarkerFrame(1, 1 / RATE_HZ, 0.0, MESH478, np.full((478, 3), np.nan))
    assert feed(frame) is not None
    assert feed(lost) is None
    assert feed(frame) is not None


def test_68_landmarks_do_as_well() -> None:
    few = [MarkerFrame(f.number, f.time_s, f.time_s, IBUG68, from_mesh(f.positions)) for f in frames()]
    feed = OpenVHeadFeed()
    told = [feed(frame) for frame in few]
    np.testing.assert_allclose([values.fields() for values in told if values is not None], numbers("steady"))


def test_other_markers_are_refused_with_what_is_needed() -> None:
    frame = MarkerFrame(0, 0.0, 0.0, MarkerLayout("face24", ("chin",)), np.zeros((1, 3)))
    with pytest.raises(InputError, match="mediapipe478 or ibug68"):
        OpenVHeadFeed()(frame)


def test_its_server_hears_our_camera() -> None:
    feed = OpenVHeadFeed()
    sent = [OpenVHeadMessage(*values.fields()) for frame in frames()[:30] if (values := feed(frame)) is not None]
    with OpenVHeadServer("tcp://127.0.0.1:0") as server:
        host, port = server.address
        with OpenVHeadClient(f"tcp://{host}:{port}") as client:
            for message in sent:
                assert client(message)
            heard = [each.message for each in itertools.islice(server, len(sent))]
    assert heard == sent
