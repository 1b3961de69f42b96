"""Calibration: twenty synthetic performers found again, and how long a minute's take needs.

Another identity and size than the rig's, K for each site, axis and direction, a hinge of their own, 0.3 mm of noise,
10 % of all samples missing, 5 % off by 5 to 30 mm, the head in motion; 120 Hz. Without reference poses, K is known
because the performer goes to what the rig's own extremes mean for this face; see `tests.synthetic.rom`.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from calib.performer_command import calibrated as calibrated_by_command
from retarget.rig.load import load_rig
from tests.benchmarks.report import Row
from tests.calib.truth import Recovery, recovered
from tests.synthetic.demo_take import write_c3d
from tests.synthetic.face import ALL_SITES, face_layout
from tests.synthetic.rom import neutral_take, person, range_of_motion, rough

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

SEEDS = 20


def rows() -> Iterator[Row]:
    """Recovery with both layouts, then the time."""
    rig = load_rig("human")
    for what, layout in (
        ("41 sites and a band", face_layout("all", ALL_SITES)),
        ("face24, one chin marker", face_layout()),
    ):
        found = [recovered(rig, layout, seed) for seed in range(SEEDS)]
        yield from _recovery(what, found)
    yield from _duration()


def _recovery(what: str, found: list[Recovery]) -> Iterator[Row]:
    K = np.abs(np.concatenate([r.K for r in found]))
    small = np.abs(np.concatenate([r.K_small for r in found]))
    told = f"{what}: K where the rig goes 3 mm and more"
    yield Row(f"{told}, median of {K.size:,}", 100 * float(np.median(K)), "%")
    yield Row(f"{told}, 99th percentile", 100 * float(np.quantile(K, 0.99)), "%", aim="5")
    yield Row(f"{told}, worst", 100 * float(K.max()), "%", aim="5")
    yield Row(f"{what}: K where it goes 1 to 3 mm, 95th percentile", 100 * float(np.quantile(small, 0.95)), "%")
    for name, unit, aim, values in (
        ("hinge axis", "degrees", "2", [r.axis_deg for r in found]),
        ("hinge pivot", "mm", "5", [1e3 * r.pivot_m for r in found]),
        ("gain of the jaw", "%", "", [100 * abs(r.gain) for r in found]),
        ("jaw angle, noise-free markers, RMS", "degrees", "0.5", [_rms(r.angle_deg) for r in found]),
        (
            "jaw angle, noise-free markers, worst frame",
            "degrees",
            "0.5",
            [float(np.abs(r.angle_deg).max()) for r in found],
        ),
        ("jaw angle with 0.3 mm noise, RMS", "degrees", "0.5", [_rms(r.noisy_angle_deg) for r in found]),
    ):
        yield Row(f"{what}: {name}, median seed", float(np.median(values)), unit, aim=aim)
        yield Row(f"{what}: {name}, worst seed", max(values), unit, aim=aim)
    for name in ("calibrated", "one", "scale", "warp"):
        scores = [getattr(r.calibration.score, name) for r in found if r.calibration.score]
        yield Row(f"{what}: held-out error, {name}", float(np.median(scores)), "mm")


def _rms(errors: NDArray[np.float64]) -> float:
    return float(np.sqrt((errors**2).mean()))


def _duration() -> Iterator[Row]:
    """The command's own work, from the files on: a minute at 120 Hz with 41 markers."""
    rng = np.random.default_rng(1)
    sites = tuple(
        site for site in ALL_SITES if site not in ("cheekOuterLeft", "cheekOuterRight", "eyeInnerLeft", "eyeInnerRight")
    )
    face = person(load_rig("human"), face_layout("face24", sites), rng)
    with tempfile.TemporaryDirectory() as folder:
        neutral, rom, out = (Path(folder) / name for name in ("neutral.c3d", "rom.c3d", "out.toml"))
        write_c3d(rough(neutral_take(face, rng), rng), neutral)
        take = rough(range_of_motion(face, rng, rounds=3), rng)
        write_c3d(take, rom)
        options: dict[str, object] = {
            "neutral": (str(neutral),),
            "rom": (str(rom),),
            "poses": None,
            "live": None,
            "rig": "human",
        }
        options |= {
            "layout": str(_card(Path(folder), take.layout.names)),
            "name": None,
            "bounds": (0.25, 1.0),
            "record": None,
        }
        start = time.perf_counter()
        calibrated_by_command(out, options | {"seconds": 5.0})
        seconds = time.perf_counter() - start
    yield Row(f"{len(take.times) / 120:.0f} s at 120 Hz, {len(take.layout.names)} markers", seconds, "s", aim="under 5")


def _card(folder: Path, names: tuple[str, ...]) -> Path:
    """A layout of these markers."""
    lines = [f"{n} = {{ {'head = true' if n.startswith('head') else f'site = {chr(34)}{n}{chr(34)}'} }}" for n in names]
    path = folder / "mine.toml"
    path.write_text("\n".join(['version = 1\nname = "mine"\n[markers]', *lines]))
    return path
