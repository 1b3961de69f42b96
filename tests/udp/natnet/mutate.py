"""Datagrams bent in every way a hostile or broken sender might, and what the codec makes of them.

``python -m tests.udp.natnet.mutate --count 1000000`` runs more of them than the test does, and prints how many frames
whose structure is certainly wrong are believed, beside the clients `natnet` 0.3.0 and `optirx` 1.9.
"""

from __future__ import annotations

import argparse
import math
import random
import time
from dataclasses import dataclass, field
from functools import lru_cache

from retarget.errors import ProtocolError
from retarget.udp.natnet.codec import decode, encode
from retarget.udp.natnet.framedata import FrameOfData
from retarget.udp.natnet.version import Bitstream
from tests.udp.natnet.beliefs import report
from tests.udp.natnet.captures import SESSION, SESSION_VERSION, session, single_datagrams
from tests.udp.natnet.distortions import DISTORTIONS
from tests.udp.natnet.examples import every_command, face_frame, rich_frame, rich_models
from tests.udp.natnet.strategies import VERSIONS


@lru_cache(maxsize=1)
def originals() -> tuple[tuple[bytes, Bitstream], ...]:
    """Valid datagrams of every version and kind, real ones where they are at hand."""
    made = [(encode(message, v), v) for v in VERSIONS for message in (rich_frame(v), rich_models(v), face_frame())]
    made += [(encode(command), Bitstream(4, 1)) for command in every_command()]
    if SESSION.exists():
        made += [(datagram, SESSION_VERSION) for datagram in session()[:20]]
        made += [(datagram, version) for _, version, datagram in single_datagrams()]
    return tuple(made)


@dataclass(slots=True)
class Outcome:
    """What became of the mutated datagrams."""

    refused: int = 0
    accepted: int = 0
    slowest_s: float = 0.0
    wrong: list[bytes] = field(default_factory=list)
    """Accepted, but written back to other bytes: the value does not hold what the datagram said."""


def run(count: int, seed: int) -> Outcome:
    """Decode `count` mutated datagrams; any exception but `ProtocolError` comes through."""
    rng = random.Random(seed)
    outcome = Outcome()
    for _ in range(count):
        datagram, version = rng.choice(originals())
        for _ in range(rng.choice((1, 1, 1, 2, 4))):
            datagram = rng.choice(DISTORTIONS)(rng, datagram)
        _try(outcome, datagram, version)
    return outcome


def _try(outcome: Outcome, datagram: bytes, version: Bitstream) -> None:
    start = time.perf_counter()
    try:
        message = decode(datagram, version)
    except ProtocolError:
        outcome.refused += 1
        return
    finally:
        outcome.slowest_s = max(outcome.slowest_s, time.perf_counter() - start)
    outcome.accepted += 1
    if isinstance(message, FrameOfData) and _has_nan(message):
        return
    if encode(message, version)[4:] != datagram[4:]:
        outcome.wrong.append(datagram)


def _has_nan(frame: FrameOfData) -> bool:
    """A single NaN of 32 bits may lose its quiet bit as a Python float; arrays keep it."""
    return math.isnan(frame.software_latency or 0.0) or math.isnan(frame.timestamp_s or 0.0)


def main() -> None:
    """Run from the command line; exit with an error where a datagram was read wrongly."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--believed", type=int, default=300, help="how many inconsistent frames to show to each decoder"
    )
    options = parser.parse_args()
    start = time.perf_counter()
    outcome = run(options.count, options.seed)
    print(
        f"{options.count} mutated datagrams in {time.perf_counter() - start:.0f} s: {outcome.refused} refused, "
        f"{outcome.accepted} accepted and written back to the same bytes but for {len(outcome.wrong)}; "
        f"the slowest took {1000 * outcome.slowest_s:.1f} ms."
    )
    for line in report(options.believed, options.seed):
        print(line)
    raise SystemExit(bool(outcome.wrong))


if __name__ == "__main__":
    main()
