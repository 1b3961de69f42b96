"""Why does it not connect? A NatNet connection, walked step by step, and the step named that fails.

    for step in Examination("natnet://192.168.1.10").steps():
        print(step.name, step.outcome, step.found, step.cause, step.advice)

address: who is meant, and from which address of ours is it reached? answer: is there a server? stream: where does it
send to? version: can it be read? names: what are the markers called? frames: do they come? markers: are they labelled
and seen? clock: is it in sync? losses: how many frames are lost?
"""

from __future__ import annotations

import time
from contextlib import ExitStack
from typing import TYPE_CHECKING

from retarget.errors import ConnectionFailedError, InputError
from retarget.udp.natnet.diagnosis import Outcome, Step
from retarget.udp.natnet.discovery import find_server
from retarget.udp.natnet.elsewhere import probe, who_answers, who_multicasts
from retarget.udp.natnet.line import Line
from retarget.udp.natnet.silence import no_answer, no_frames, told
from retarget.udp.natnet.url import parse_natnet_url
from retarget.udp.natnet.verdicts import (
    judge_clock,
    judge_frames,
    judge_losses,
    judge_markers,
    judge_names,
    judge_version,
)
from retarget.udp.natnet.version import LATEST, OLDEST
from retarget.udp.sockets import local_address_towards, open_udp, resolve

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from retarget.udp.natnet.messages import ServerInfo
    from retarget.udp.sockets import Address

VITAL = {"address", "answer", "stream", "version", "frames"}
"""Where one of these fails, there is nothing to examine behind it."""

_AGREEMENT_S = 1.0
_ENOUGH_UNREADABLE = 5
_REFUSAL_S = 0.3


class Examination:
    """One look at one server.

    Frames are watched for `watch_s` [s], each answer is waited for at most `patience_s` [s]. Raises `InputError` for an
    address that cannot be read.
    """

    def __init__(self, url: str, *, watch_s: float = 3.0, patience_s: float = 5.0) -> None:
        self._url = parse_natnet_url(url)
        self._watch_s, self._patience_s = watch_s, patience_s
        self._server: Address = ("", 0)
        self._local = ""
        self._opened = ExitStack()
        self._line: Line | None = None

    @property
    def marker_names(self) -> tuple[str, ...]:
        """Names of all markers, once the steps are done."""
        return self._line.session.layout.names if self._line is not None else ()

    def steps(self) -> Generator[Step, None, None]:
        """The steps in their order, each as soon as it is done."""
        failed = ""
        with self._opened:
            for name, examine in self._examinations():
                step = _done(name, examine) if not failed else _passed_over(name, failed)
                if step.outcome is Outcome.FAILED and name in VITAL:
                    failed = name
                yield step

    def _examinations(self) -> list[tuple[str, Callable[[], Step]]]:
        return [
            ("address", self._address),
            ("answer", self._answer),
            ("stream", self._stream),
            ("version", self._version),
            ("names", self._names),
            ("frames", self._frames),
            ("markers", lambda: judge_markers(self.marker_names, self._connected.observed)),
            ("clock", lambda: judge_clock(self._connected.session.clock, self._connected.observed.latencies_s)),
            ("losses", lambda: judge_losses(self._connected.stats)),
        ]

    @property
    def _connected(self) -> Line:
        if self._line is None:
            raise ConnectionFailedError(f"{self._url} is not connected.")
        return self._line

    @property
    def _info(self) -> ServerInfo:
        info = self._connected.observed.server
        if info is None:
            raise ConnectionFailedError(f"{self._url} did not answer.")
        return info

    def _address(self) -> Step:
        if self._url.host is None:
            return self._discover()
        host = resolve(self._url.host)
        self._server = (host, self._url.port)
        self._local = self._url.local or local_address_towards(host)
        open_udp(self._local).close()  # an address that is not ours is told here
        meant = "" if host == self._url.host else f"{self._url.host} is "
        return Step("address", Outcome.PASSED, f"{meant}{told(self._server)}, reached from {self._local}")

    def _discover(self) -> Step:
        try:
            found = find_server(self._url.port, self._url.local)
        except (ConnectionFailedError, InputError) as error:
            several = isinstance(error, InputError)
            cause = "one has to be chosen" if several else "none is on, or broadcasts do not get to its network"
            advice = (
                "name it, natnet://ADDRESS, or say on which network it is: natnet://?local=AN_ADDRESS_OF_OURS_THERE"
            )
            return Step("address", Outcome.FAILED, str(error).partition(". ")[0], cause, advice)
        self._server, self._local = found.address, found.local
        return Step("address", Outcome.PASSED, f"discovered {found}, reached from {self._local}")

    def _answer(self) -> Step:
        with probe(self._server, self._local) as asked:
            if asked.refusal(_REFUSAL_S) is None:
                line = self._line = self._opened.enter_context(Line(self._url, self._server, self._local))
                line.run(lambda: line.observed.server is not None, self._patience_s)
                if line.observed.server is not None:
                    sender = line.observed.server.sender
                    version = ".".join(map(str, sender.app_version))
                    who = sender.name or "a server without a name"
                    return Step("answer", Outcome.PASSED, f"{who}, version {version}")
            refusal = asked.refusal(0.0)
        others = [] if refusal is not None else who_answers(self._server, self._local)
        return no_answer(self._server, refusal, others, self._patience_s)

    def _stream(self) -> Step:
        announced = self._info.connection
        group = self._url.group_for(announced)
        if group is None:
            return Step("stream", Outcome.PASSED, f"unicast, to {self._local}")
        self._connected.link.join(group)
        found = f"multicast, group {told(group)} joined on {self._local}"
        if announced is not None and not announced.is_multicast:
            return Step(
                "stream",
                Outcome.WARNED,
                found,
                "the server announces unicast, and ?multicast asks for the other",
                "leave ?multicast out, or set the server to multicast",
            )
        return Step("stream", Outcome.PASSED, found)

    def _version(self) -> Step:
        line, announced = self._connected, self._info.sender.bitstream
        if announced >= OLDEST:
            line.run(lambda: line.session.ready(time.monotonic()), _AGREEMENT_S)
        if announced > LATEST:  # only its frames can show whether it is readable
            seen = line.observed
            line.run(lambda: seen.frames > 0 or seen.unreadable_frames >= _ENOUGH_UNREADABLE, self._watch_s)
        return judge_version(announced, line.session.bitstream, line.observed)

    def _names(self) -> Step:
        line = self._connected
        line.run(lambda: line.observed.described or line.observed.unreadable_definitions > 1, self._patience_s)
        return judge_names(self.marker_names, line.observed)

    def _frames(self) -> Step:
        line = self._connected
        line.watch(self._watch_s)
        if line.observed.frames or line.observed.unreadable_frames:
            return judge_frames(line.observed, line.session.rate_hz, line.session.bitstream)
        group = line.link.group
        heard = who_multicasts(group or self._url.usual_group(self._info.connection))
        return no_frames(self._server, self._local, group, heard, line.link.foreign)


def _done(name: str, examine: Callable[[], Step]) -> Step:
    try:
        return examine()
    except ConnectionFailedError as error:
        what, _, advice = str(error).rstrip(".").partition(". ")
        return Step(name, Outcome.FAILED, what, advice=advice)


def _passed_over(name: str, failed: str) -> Step:
    return Step(name, Outcome.SKIPPED, "not examined", f"{failed} failed")
