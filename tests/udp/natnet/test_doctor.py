"""Broken servers on loopback: the step that fails, and the usual cause."""

from __future__ import annotations

import pytest

from retarget.errors import InputError
from retarget.udp.natnet.diagnosis import Outcome, Step
from retarget.udp.natnet.doctor import Examination
from retarget.udp.natnet.messages import Connect, Discovery, EchoRequest, RequestModelDef
from retarget.udp.natnet.models import ModelDef
from retarget.udp.natnet.playback import AtEnd
from retarget.udp.sockets import LOOPBACK, open_udp
from tests.udp.natnet.broken import (
    BrokenServer,
    Script,
    all_occluded,
    losing_every_tenth,
    without_frames,
    without_labels,
)
from tests.udp.natnet.live import GROUP, free_group_port, serve, take, until, url

PASSED, WARNED, FAILED, SKIPPED = Outcome.PASSED, Outcome.WARNED, Outcome.FAILED, Outcome.SKIPPED
NAMES = ["address", "answer", "stream", "version", "names", "frames", "markers", "clock", "losses"]


@pytest.fixture(autouse=True)
def _only_loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("retarget.udp.natnet.elsewhere.local_addresses", lambda: [LOOPBACK])


def examine(address: str, *, watch_s: float = 0.15, patience_s: float = 5.0) -> dict[str, Step]:
    """The steps by name; every examination has all of them."""
    steps = list(Examination(address, watch_s=watch_s, patience_s=patience_s).steps())
    assert [step.name for step in steps] == NAMES
    return {step.name: step for step in steps}


def outcomes(steps: dict[str, Step]) -> dict[Outcome, list[str]]:
    return {
        outcome: [name for name, step in steps.items() if step.outcome is outcome]
        for outcome in {step.outcome for step in steps.values()}
    }


def assert_only(steps: dict[str, Step], outcome: Outcome, name: str) -> Step:
    """All steps passed but one."""
    assert outcomes(steps) == {PASSED: [n for n in NAMES if n != name], outcome: [name]}
    assert steps[name].cause
    assert steps[name].advice
    return steps[name]


def assert_ends_at(steps: dict[str, Step], name: str) -> Step:
    """The step failed, what was before it did not, and nothing behind it was examined."""
    at = NAMES.index(name)
    assert all(steps[n].outcome in {PASSED, WARNED} for n in NAMES[:at])
    assert steps[name].outcome is FAILED
    assert all(steps[n].outcome is SKIPPED for n in NAMES[at + 1 :])
    assert all(name in steps[n].cause for n in NAMES[at + 1 :])
    return steps[name]


def test_all_steps_of_a_healthy_server_pass() -> None:
    with serve(take(240), at_end=AtEnd.LOOP) as server:
        steps = examine(url(server))
    assert outcomes(steps)[PASSED] == NAMES
    assert not any(step.cause or step.advice for step in steps.values())
    assert "24 markers: marker00" in steps["names"].found
    assert "240 Hz" in steps["frames"].found


def test_the_scripted_server_is_healthy_when_nothing_is_wrong_with_it() -> None:
    with BrokenServer(Script()) as server:
        assert outcomes(examine(server.url))[PASSED] == NAMES


def test_a_healthy_multicast_server_passes() -> None:
    with serve(take(240), at_end=AtEnd.LOOP, multicast=GROUP, data_port=free_group_port()) as server:
        steps = examine(url(server))
    assert outcomes(steps)[PASSED] == NAMES
    assert f"group {GROUP}" in steps["stream"].found


def test_a_server_is_discovered_where_no_host_is_given() -> None:
    with serve(take(240), at_end=AtEnd.LOOP) as server:
        steps = examine(f"natnet://:{server.address[1]}?local={LOOPBACK}")
        assert f"discovered retarget at {LOOPBACK}:{server.address[1]}" in steps["address"].found
    assert outcomes(steps)[PASSED] == NAMES


def test_steps_come_as_they_are_done_and_the_server_is_left_when_they_are_not_wanted() -> None:
    with serve(take(240), at_end=AtEnd.LOOP) as server:
        steps = Examination(url(server), watch_s=60.0).steps()
        assert [next(steps).name for _ in range(5)] == NAMES[:5]
        assert server.clients == 1
        steps.close()
        until(lambda: server.clients == 0)


def test_discovery_that_finds_nobody_says_where_it_looked() -> None:
    with open_udp() as free:
        port = free.address[1]
    step = assert_ends_at(examine(f"natnet://:{port}?local={LOOPBACK}"), "address")
    assert LOOPBACK in step.found
    assert "natnet://ADDRESS" in step.advice


def test_a_host_that_is_not_known_fails_at_the_address() -> None:
    step = assert_ends_at(examine("natnet://no-such-host.invalid"), "address")
    assert "no-such-host.invalid" in step.found


def test_an_address_that_is_not_ours_is_told() -> None:
    step = assert_ends_at(examine("natnet://127.0.0.1?local=192.0.2.99"), "address")
    assert "192.0.2.99 is not an address of this machine" in step.found


def test_nobody_bound_is_told_from_silence() -> None:
    with open_udp() as free:
        port = free.address[1]
    step = assert_ends_at(examine(f"natnet://{LOOPBACK}:{port}"), "answer")
    assert "no program listens" in step.found
    assert str(port) in step.advice


def test_a_port_that_swallows_everything_looks_like_a_firewall() -> None:
    with open_udp() as silent:
        step = assert_ends_at(examine(f"natnet://{LOOPBACK}:{silent.address[1]}", patience_s=0.4), "answer")
    assert "neither an answer nor a refusal" in step.found
    assert "firewall" in step.cause


def test_a_server_that_answers_from_another_card_is_named() -> None:
    with BrokenServer(Script(answers_from="127.0.0.3")) as server:
        step = assert_ends_at(examine(server.url, patience_s=0.4), "answer")
    assert "127.0.0.3" in step.found
    assert "natnet://127.0.0.3:" in step.advice


def test_a_server_without_frames_is_paused_or_behind_a_firewall() -> None:
    with BrokenServer(Script(frame=without_frames)) as server:
        step = assert_ends_at(examine(server.url), "frames")
    assert "sends no frames" in step.found
    assert "paused" in step.cause


def test_too_old_a_version_fails_at_the_version() -> None:
    with BrokenServer(Script(version=(2, 0))) as server:
        step = assert_ends_at(examine(server.url), "version")
    assert "bitstream 2.0" in step.found
    assert "too old" in step.cause


def test_a_version_of_the_future_whose_frames_cannot_be_read_fails_at_the_version() -> None:
    with BrokenServer(Script(version=(5, 0), tail=bytes(9))) as server:
        step = assert_ends_at(examine(server.url, watch_s=0.4), "version")
    assert "bitstream 5.0 is not known" in step.found
    assert "4.3" in step.advice


def test_a_version_of_the_future_whose_frames_can_be_read_is_a_warning() -> None:
    with BrokenServer(Script(version=(4, 9))) as server:
        step = assert_only(examine(server.url, watch_s=0.4), WARNED, "version")
    assert "bitstream 4.9" in step.found


def test_frames_of_another_version_than_announced_fail_at_the_frames() -> None:
    with BrokenServer(Script(tail=bytes(9))) as server:
        steps = examine(server.url)
    assert "none of which is of bitstream 4.1" in assert_ends_at(steps, "frames").found


def test_frames_without_labelled_markers_are_told_with_the_points_that_are_there() -> None:
    with BrokenServer(Script(frame=without_labels)) as server:
        step = assert_only(examine(server.url), FAILED, "markers")
    assert "24 points without a name" in step.found
    assert "asset" in step.advice


def test_markers_of_which_none_is_seen_are_told() -> None:
    with BrokenServer(Script(frame=all_occluded)) as server:
        step = assert_only(examine(server.url), FAILED, "markers")
    assert "none of them is seen" in step.found


def test_names_that_do_not_come_are_missed_and_the_rest_is_examined() -> None:
    with BrokenServer(Script(mute=(RequestModelDef,))) as server:
        steps = examine(server.url, patience_s=0.4)
    assert "no model definitions came" in steps["names"].found
    assert "larger than one packet" in steps["names"].cause
    assert outcomes(steps) == {
        PASSED: [n for n in NAMES if n not in {"names", "markers"}],
        WARNED: ["markers"],
        FAILED: ["names"],
    }


def test_definitions_without_a_marker_are_told_from_missing_ones() -> None:
    with BrokenServer(Script(definitions=lambda _: ModelDef(()))) as server:
        step = examine(server.url)["names"]
    assert step.outcome is FAILED
    assert "describe no marker" in step.found


def test_a_clock_that_cannot_be_read_is_a_warning() -> None:
    with BrokenServer(Script(mute=(EchoRequest,))) as server:
        step = assert_only(examine(server.url), WARNED, "clock")
    assert "not in sync" in step.found


def test_every_tenth_frame_lost_fails_at_the_losses() -> None:
    with BrokenServer(Script(frame=losing_every_tenth)) as server:
        step = assert_only(examine(server.url, watch_s=0.6), FAILED, "losses")
    lost, _, rest = step.found.partition(" of ")
    assert 0.05 < int(lost) / int(rest.split()[0]) < 0.15
    assert "lost on the way" in step.cause


def test_a_group_that_does_not_get_here_is_told_as_multicast() -> None:
    port = free_group_port()
    with BrokenServer(Script(group=(GROUP, port), frame=without_frames)) as server:
        step = assert_ends_at(examine(server.url), "frames")
    assert f"{GROUP}:{port}" in step.found
    assert "switch" in step.cause
    assert "Local Interface" in step.advice


def test_a_group_whose_frames_come_from_another_card_names_it() -> None:
    group = (GROUP, free_group_port())
    with BrokenServer(Script(group=group, sends_to=group, sends_from="127.0.0.2")) as server:
        step = assert_ends_at(examine(server.url), "frames")
    assert "come from 127.0.0.2" in step.found
    assert "natnet://127.0.0.2:" in step.advice


def test_a_server_that_keeps_quiet_about_its_group_is_found_out() -> None:
    port = free_group_port()
    with BrokenServer(Script(sends_to=(GROUP, port))) as server:
        step = examine(f"{server.url}?data_port={port}")["frames"]
    assert step.outcome is FAILED
    assert "multicast=1" in step.advice


def test_a_group_asked_for_where_unicast_is_announced_is_a_warning() -> None:
    port = free_group_port()
    with BrokenServer(Script(sends_to=(GROUP, port))) as server:
        step = assert_only(examine(f"{server.url}?multicast=1&data_port={port}"), WARNED, "stream")
    assert "announces unicast" in step.cause


def test_a_stream_that_ends_meanwhile_is_told() -> None:
    with BrokenServer(Script(ends_after=20)) as server:
        step = assert_only(examine(server.url, watch_s=5.0), WARNED, "frames")
    assert "ended the stream" in step.cause


def test_a_server_that_answers_only_what_makes_a_client_is_examined_too() -> None:
    with BrokenServer(Script(mute=(Discovery,))) as server:
        assert outcomes(examine(server.url))[PASSED] == NAMES


def test_a_server_that_answers_discovery_alone_counts_as_silent() -> None:
    with BrokenServer(Script(mute=(Connect,))) as server:
        assert_ends_at(examine(server.url, patience_s=0.4), "answer")


def test_what_is_no_address_is_refused_before_anything_is_opened() -> None:
    with pytest.raises(InputError, match="not the address"):
        Examination("take.c3d")
