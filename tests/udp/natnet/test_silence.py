"""Causes that only a machine with several network cards meets."""

from __future__ import annotations

from retarget.udp.natnet.diagnosis import Outcome
from retarget.udp.natnet.silence import no_answer, no_frames
from retarget.udp.sockets import Refusal

SERVER = ("192.0.2.10", 1510)
GROUP = ("239.255.42.99", 1511)


def test_a_group_joined_on_the_wrong_card_names_the_right_one() -> None:
    heard = [("198.51.100.5", ("192.0.2.10", 1511))]
    step = no_frames(SERVER, "192.0.2.5", GROUP, heard, 0)
    assert step.outcome is Outcome.FAILED
    assert step.name == "frames"
    assert "wrong network card" in step.cause
    assert step.advice.endswith("?local=198.51.100.5")


def test_the_servers_own_frames_count_before_those_of_others() -> None:
    heard = [("198.51.100.5", ("203.0.113.9", 1511)), ("198.51.100.6", ("192.0.2.10", 1511))]
    assert no_frames(SERVER, "192.0.2.5", GROUP, heard, 0).advice.endswith("?local=198.51.100.6")


def test_frames_of_other_servers_in_the_group_do_not_explain_silent_unicast() -> None:
    heard = [("192.0.2.5", ("203.0.113.9", 1511))]
    assert "paused" in no_frames(SERVER, "192.0.2.5", None, heard, 0).cause


def test_frames_from_another_address_explain_silent_unicast() -> None:
    step = no_frames(SERVER, "192.0.2.5", None, [], 120)
    assert "120 datagrams come from others" in step.found


def test_a_machine_that_the_network_knows_to_be_gone_is_no_firewall() -> None:
    step = no_answer(SERVER, Refusal.HOST, [], 5.0)
    assert "cannot be reached" in step.found
    assert "the machine is off" in step.cause
