"""What the counts of an examined stream mean: good, usable or not, the usual cause, and what to do."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING

from retarget.udp.natnet.diagnosis import Outcome, Step
from retarget.udp.natnet.version import LATEST, OLDEST

if TYPE_CHECKING:
    from collections.abc import Sequence

    from retarget.udp.natnet.clock import EchoClock
    from retarget.udp.natnet.observation import Observation
    from retarget.udp.natnet.version import Bitstream
    from retarget.udp.stats import StreamStats

TOLERATED_LOSS = 0.01
"""Share of frames; a marker is missing for a frame now and then anyway, and is filled."""

_SLOW_ROUND_TRIP_S = 0.010
_LATEST_EXPOSURE_S = 1.0
_EARLIEST_EXPOSURE_S = -0.010
_SHOWN = 6


def judge_version(announced: Bitstream, read_as: Bitstream | None, observed: Observation) -> Step:
    """Whether frames of the announced bitstream can be read; `observed` holds some where it is a new one."""
    if announced < OLDEST:
        return Step(
            "version",
            Outcome.FAILED,
            f"bitstream {announced}; {OLDEST} to {LATEST} can be read",
            "the server is too old",
            f"update it to one that sends {OLDEST} or later",
        )
    if announced <= LATEST:
        other = "" if read_as == announced else f"; frames are read as {read_as}"
        return Step("version", Outcome.PASSED, f"bitstream {announced}{other}")
    found = f"bitstream {announced} is not known; {OLDEST} to {LATEST} are, and frames are read as {read_as}"
    advice = f"choose an older bitstream in the server's streaming settings, {LATEST} at the most"
    if observed.unreadable_frames and not observed.frames:
        return Step("version", Outcome.FAILED, found, "the server is newer than this program", advice)
    cause = "the server is newer than this program, and what it added is left out"
    return Step("version", Outcome.WARNED, found, cause, advice)


def judge_names(names: Sequence[str], observed: Observation) -> Step:
    """Whether model definitions came and name markers."""
    if names and observed.described:
        return Step("names", Outcome.PASSED, f"{len(names)} markers: {shortened(names)}")
    if observed.described:
        return Step(
            "names",
            Outcome.FAILED,
            "the model definitions describe no marker",
            "no asset is enabled on the server",
            "create or enable the asset or marker set of the face",
        )
    if observed.unreadable_definitions:
        return Step(
            "names",
            Outcome.FAILED,
            "the model definitions came and cannot be read",
            "they are not of the bitstream that the server announces",
            "choose another bitstream, ?bitstream=3.1",
        )
    return Step(
        "names",
        Outcome.FAILED,
        "no model definitions came, though asked for",
        "they are larger than one packet, and a firewall, a VPN or a tunnel on the way drops the pieces",
        "let fragmented UDP pass, or use a plain wired network",
    )


def judge_frames(observed: Observation, told_hz: float | None, read_as: Bitstream | None) -> Step:
    """Frames of which some came; `silence.no_frames` is for none."""
    if not observed.frames:
        return Step(
            "frames",
            Outcome.FAILED,
            f"{observed.unreadable_frames} came, none of which is of bitstream {read_as}",
            "the server sends another bitstream than it announces",
            "restart the server, or ask it for ?bitstream=3.1",
        )
    told = "" if told_hz is None else f" (the server tells {told_hz:.4g} Hz)"
    found = f"{observed.frames:,} in {observed.last_s - observed.first_s:.1f} s, {observed.rate_hz:.4g} Hz{told}"
    if observed.ended:
        return Step(
            "frames", Outcome.WARNED, found, "the server ended the stream", "play the take in a loop, or go live"
        )
    return Step("frames", Outcome.PASSED, found)


def judge_markers(names: Sequence[str], observed: Observation) -> Step:
    """Whether the frames hold labelled markers, and which of those that are known were never seen."""
    if not observed.labelled and len(observed.unseen(names)) == len(names):
        return _unlabelled(observed)
    if not observed.described:
        return Step(
            "markers",
            Outcome.WARNED,
            f"{observed.labelled} labelled, which have numbers for names",
            "the names are missing, see above",
            "look to the names first",
        )
    unseen = observed.unseen(names)
    if len(unseen) == len(names):
        return Step(
            "markers",
            Outcome.FAILED,
            f"{len(names)} are sent and none of them is seen",
            "nobody is in view, or the server does not recognise its asset",
            "step into the volume; check the asset",
        )
    found = f"{len(names) - len(unseen)} of {len(names)} seen"
    if unseen:
        return Step(
            "markers",
            Outcome.WARNED,
            f"{found}; never {shortened(unseen)}",
            "they fell off, are hidden from the cameras, or are labelled as others",
            "check them on the performer",
        )
    return Step("markers", Outcome.PASSED, found)


def judge_clock(clock: EchoClock | None, latencies_s: Sequence[float]) -> Step:
    """Whether the time of exposure is known on the local clock."""
    if clock is None:
        return Step("clock", Outcome.SKIPPED, "servers before 3.0 have none that could be read")
    if not clock.synchronised:
        return Step(
            "clock",
            Outcome.WARNED,
            "echo requests are not answered, so it is not in sync",
            "a firewall or a relay lets frames pass and echoes not",
            "times are estimated from arrivals meanwhile; let UDP pass both ways on the command port",
        )
    found = f"round trip {1e3 * clock.best_round_trip_s:.2f} ms"
    if not latencies_s:
        return Step("clock", Outcome.PASSED, f"{found}; frames do not tell their exposure")
    latency_s = median(latencies_s)
    if not _EARLIEST_EXPOSURE_S - clock.best_round_trip_s < latency_s < _LATEST_EXPOSURE_S:
        return Step(
            "clock",
            Outcome.WARNED,
            f"{found}; frames claim to be exposed {latency_s:.3g} s before they come",
            "it is not in sync: frames are stamped by another clock than the one that answers",
            "times are estimated from arrivals meanwhile; play recordings with `retarget replay`, or go live",
        )
    found += f", exposure to arrival {1e3 * latency_s:.1f} ms"
    if clock.best_round_trip_s > _SLOW_ROUND_TRIP_S:
        return Step("clock", Outcome.WARNED, found, "the network is slow, as wireless ones and VPNs are", "use a cable")
    return Step("clock", Outcome.PASSED, found)


def judge_losses(stats: StreamStats) -> Step:
    """How many frames did not get here, and where they went."""
    gone = stats.lost + stats.dropped
    share = gone / max(1, gone + stats.received)
    found = f"{gone:,} of {gone + stats.received:,} frames lost"
    found += "".join(
        f", {count:,} {what}"
        for what, count in (("doubled", stats.doubled), ("late", stats.late), ("malformed", stats.malformed))
        if count
    )
    if not gone and not stats.doubled and not stats.malformed:
        return Step("losses", Outcome.PASSED, found)
    outcome = Outcome.FAILED if share > TOLERATED_LOSS else Outcome.WARNED
    return Step("losses", outcome, f"{found} ({share:.1%})" if gone else found, *_where_lost(stats))


def shortened(names: Sequence[str]) -> str:
    """The first few of the names."""
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")


def _unlabelled(observed: Observation) -> Step:
    if observed.loose:
        return Step(
            "markers",
            Outcome.FAILED,
            f"none is labelled; up to {observed.loose} points without a name a frame",
            "the server sees markers and does not know whose they are: no asset is enabled, or labelling is off",
            "create or enable the asset of the face, so that its markers are labelled",
        )
    return Step(
        "markers",
        Outcome.FAILED,
        "the frames hold no markers, labelled or not",
        "labelled markers are switched off in the server's streaming settings",
        "switch on Labeled Markers and Marker Sets in the streaming pane of Motive",
    )


def _where_lost(stats: StreamStats) -> tuple[str, str]:
    """Cause and advice."""
    if stats.overflowed or stats.dropped:
        return "this machine does not keep up", "close other programs; nothing else is needed on the network"
    if stats.lost:
        return "packets are lost on the way: a wireless link, a weak switch or a full line", "use a cable of its own"
    if stats.doubled:
        return "frames come by two ways: two network cards or two servers send them", "leave one of the two"
    return "something else sends to this port, or packets are damaged", "look for a second server"
