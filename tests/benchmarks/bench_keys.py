"""Keys of the error-bounded fit against plain Ramer-Douglas-Peucker at the same largest error, and how long it takes.

On the markers of the recorded jaw take where it is at hand, else on a synthetic performance.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from retarget.export.keys import fit_curves, line_keys, report_keys
from tests.benchmarks.report import Row

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

JAW = Path(__file__).parents[2] / "../shared/data/animface/jaw.c3d"
LONG_FRAMES = 72_000
LONG_HZ = 120.0


def rows() -> Iterator[Row]:
    """Keys kept and largest error at each tolerance, then the time for ten minutes at 120 Hz."""
    places_mm, rate_hz, what = _places_mm()
    times_s = np.arange(places_mm.shape[1]) / rate_hz
    for tolerance_mm in (0.1, 0.2, 0.5, 1.0):
        curves = fit_curves(times_s, places_mm, tolerance_mm)
        report = report_keys(what, "mm", [(times_s, places) for places in places_mm], curves)
        lines = [line_keys(times_s, places, tolerance_mm) for places in places_mm]
        within = f"{what}, {report.before:,} recorded, within {tolerance_mm:g} mm"
        yield Row(within, report.after, "keys", "RDP", sum(map(len, lines)), "half")
        yield Row("  largest error", report.largest_error, "mm", "RDP", _worst(times_s, places_mm, lines))
    long_s = np.arange(LONG_FRAMES) / LONG_HZ
    there_and_back = np.concatenate([places_mm, places_mm[:, ::-1]], axis=1)
    index = np.minimum(long_s * rate_hz % (there_and_back.shape[1] - 1), there_and_back.shape[1] - 2)
    low, part = index.astype(int), (index % 1)[None, :, None]
    long_mm = there_and_back[:, low] * (1 - part) + there_and_back[:, low + 1] * part
    start = time.perf_counter()
    fit_curves(long_s, long_mm, 0.2)
    yield Row(f"{len(long_mm)} channels of {LONG_FRAMES:,} frames within 0.2 mm", time.perf_counter() - start, "s")


def _worst(times_s: NDArray[np.float64], places_mm: NDArray[np.float64], lines: list[NDArray[np.intp]]) -> float:
    errors = []
    for places, keys in zip(places_mm, lines, strict=True):
        fitted = np.stack([np.interp(times_s, times_s[keys], places[keys, c]) for c in range(3)], axis=1)
        errors.append(float(np.linalg.norm(fitted - places, axis=1).max()))
    return max(errors)


def _places_mm() -> tuple[NDArray[np.float64], float, str]:
    """Markers (M, N, 3) [mm], their rate [Hz] and what they are."""
    if JAW.exists():
        import ezc3d

        points = ezc3d.c3d(str(JAW))["data"]["points"][:3]
        return np.ascontiguousarray(np.moveaxis(points, (1, 2, 0), (0, 1, 2))), 60.0, "jaw take"
    rng = np.random.default_rng(0)
    t = np.arange(1600) / 60
    waves = [5 * np.sin(np.outer(rng.uniform(2, 9, 123), t)), rng.normal(scale=0.03, size=(123, 1600))]
    return np.sum(waves, axis=0).reshape(41, 3, 1600).transpose(0, 2, 1).copy(), 60.0, "synthetic face"
