"""Why nothing is heard of a server, or no frames: the usual causes, told apart by what is heard instead."""

from __future__ import annotations

from typing import TYPE_CHECKING

from retarget.udp.natnet.diagnosis import Outcome, Step
from retarget.udp.sockets import Refusal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from retarget.udp.sockets import Address


def no_answer(server: Address, refused: Refusal | None, others: Sequence[Address], waited_s: float) -> Step:
    """Nobody answers at `server`: what the network said against it, and who answered in its place."""
    if refused is Refusal.PORT:
        return Step(
            "answer",
            Outcome.FAILED,
            f"{told(server)} refuses: no program listens on the port",
            "the server is not running, streaming is switched off, or its command port is another",
            f"switch on streaming in Motive, or start `retarget replay`, and compare its command port with {server[1]}",
        )
    if refused is Refusal.HOST:
        return Step(
            "answer",
            Outcome.FAILED,
            f"{told(server)} cannot be reached, says the network",
            "the machine is off, has another address, or a firewall rejects it",
            "check the address and the cable",
        )
    if others:
        return Step(
            "answer",
            Outcome.FAILED,
            f"{told(server)} is silent, but {told(others[0])} answers in its place",
            "the server has several network cards and answers from another one, or stands behind a relay",
            f"use natnet://{told(others[0])}, or set the server's Local Interface to this network",
        )
    return Step(
        "answer",
        Outcome.FAILED,
        f"{told(server)} is silent: neither an answer nor a refusal in {waited_s:g} s",
        "a firewall drops UDP (on the server, here or between), or another machine has the address",
        f"let UDP pass on port {server[1]} of the server, check its address, and that it streams on this network",
    )


def no_frames(
    server: Address, local: str, group: Address | None, heard: Sequence[tuple[str, Address]], foreign: int
) -> Step:
    """A server answers and its frames do not come, to this client or to the `group` joined on `local`.

    `heard` is who sends frames to the group, and on which address of ours they come; `foreign` counts datagrams that
    came here from somebody else.
    """
    for interface, sender in heard:
        if sender[0] != server[0]:
            continue
        if group is None:
            return Step(
                "frames",
                Outcome.FAILED,
                "none come to this client, but they do to the multicast group",
                "the server is set to multicast and does not say so",
                f"use natnet://{told(server)}?multicast=1&local={interface}",
            )
        return Step(
            "frames",
            Outcome.FAILED,
            f"none come to the group on {local}, but they do on {interface}",
            "the group is joined on the wrong network card",
            f"use natnet://{told(server)}?local={interface}",
        )
    if group is not None and heard:
        interface, sender = heard[0]
        return Step(
            "frames",
            Outcome.FAILED,
            f"the group's frames come from {sender[0]}, not from {server[0]}",
            "the server has several network cards, or another server sends to the same group",
            f"use natnet://{sender[0]}:{server[1]}?local={interface}, or set the server's Local Interface",
        )
    return _nowhere(local, group, foreign)


def told(address: Address) -> str:
    """As a person writes it."""
    return f"{address[0]}:{address[1]}"


def _nowhere(local: str, group: Address | None, foreign: int) -> Step:
    if group is not None:
        return Step(
            "frames",
            Outcome.FAILED,
            f"none come to the group {told(group)}, on any network card",
            "the server sends on another of its network cards, a switch or an access point holds multicast back, or it "
            "is paused",
            f"set the server's Local Interface to the network of {local}, or set it to unicast; is it playing or live?",
        )
    if foreign:
        return Step(
            "frames",
            Outcome.FAILED,
            f"none come from the server's address; {foreign} datagrams come from others",
            "the server sends from another of its network cards",
            "set the server's Local Interface to this network, or use that card's address",
        )
    return Step(
        "frames",
        Outcome.FAILED,
        "the server answers and sends no frames",
        "it is paused, in Edit mode without playback, or a firewall lets only its answers pass",
        "go live or play the take, and check that Broadcast Frame Data is on",
    )
