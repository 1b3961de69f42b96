"""A picture of a take: when each marker was not seen, and how regularly the frames came. Needs the extra `plots`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from retarget.errors import InputError, OutputError
from retarget.take.analysis import intervals_ms
from retarget.take.visibility import runs

if TYPE_CHECKING:
    from pathlib import Path

    from retarget.take.analysis import Inspection

ENDINGS: Final = (".png", ".svg", ".pdf")
_GAP, _LOST, _SEEN, _BARS = "#c0392b", "#2b2b2b", "#e8eef2", "#2c6e91"
_INCHES_PER_MARKER: Final = 0.16
MOST_MARKERS: Final = 250
"""Of more markers, those that were seen least are drawn."""


def plot_inspection(inspection: Inspection, target: Path) -> None:
    """Write the picture; its format is that of the name's ending.

    Raises InputError for another ending and where matplotlib is not installed, OutputError where it cannot be written.
    """
    if target.suffix.lower() not in ENDINGS:
        raise InputError(f"{target} cannot be drawn; expected a name that ends in {', '.join(ENDINGS)}")
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError("Plots need matplotlib: install retarget with the extra 'plots'") from error
    live = bool(inspection.channels)
    gaps_height = 1.2 + _INCHES_PER_MARKER * min(len(inspection.markers), MOST_MARKERS)
    heights = [gaps_height, 2.4] if live else [gaps_height]
    figure = Figure(figsize=(10, 1.4 + sum(heights)), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(f"{inspection.path.name}: {_headline(inspection)}", fontsize=11)
    axes = figure.subplots(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    _draw_gaps(axes[0], inspection)
    if live:
        _draw_intervals(axes[1], inspection)
    try:
        figure.savefig(target, dpi=110)
    except OSError as error:
        raise OutputError(f"{target} cannot be written: {error.strerror}") from error


def _headline(inspection: Inspection) -> str:
    frames = inspection.frames
    rate = f" at {inspection.rate_hz:g} Hz" if inspection.rate_hz else ""
    told = f"{frames.received} frames{rate}, {inspection.duration_s:.1f} s"
    return f"{told}; {frames.lost} lost, {frames.doubled} doubled" if inspection.channels else told


def _draw_gaps(axes: Any, inspection: Inspection) -> None:
    times = inspection.frame_times_s
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    ends = np.append(times, times[-1:] + step)
    columns = range(len(inspection.markers))
    drawn = sorted(sorted(columns, key=lambda i: inspection.markers[i].seen)[:MOST_MARKERS])
    for row, column in enumerate(drawn):
        axes.broken_barh([(ends[0], ends[-1] - ends[0])], (row - 0.4, 0.8), color=_SEEN, linewidth=0)
        gaps = [(ends[a], ends[b] - ends[a]) for a, b in runs(~inspection.seen[:, column])]
        axes.broken_barh(gaps, (row - 0.4, 0.8), color=_GAP, linewidth=0.4)
        share = f"{100 * inspection.markers[column].seen:.1f} %"
        axes.annotate(share, (1.005, row), xycoords=("axes fraction", "data"), va="center", fontsize=7)
    for i in np.flatnonzero(np.diff(inspection.frame_numbers) > 1):
        axes.axvspan(times[i] + step, times[i + 1], color=_LOST, linewidth=0.4)
    axes.set_yticks(range(len(drawn)), [inspection.markers[i].name for i in drawn], fontsize=7)
    axes.set_ylim(len(drawn) - 0.4, -0.6)
    axes.set_xlim(ends[0], ends[-1])
    axes.set_xlabel("time [s]")
    axes.set_title(
        "not seen (red), no frames (dark), and the share of frames in which each marker was seen",
        fontsize=9,
        loc="left",
    )


def _draw_intervals(axes: Any, inspection: Inspection) -> None:
    steps = intervals_ms(inspection.frame_times_s)
    if not len(steps):
        return
    longest = float(np.percentile(steps, 99.9)) * 1.1
    axes.hist(np.minimum(steps, longest), bins=80, color=_BARS)
    axes.set_yscale("log")
    axes.set_xlabel("time from one frame to the next [ms]")
    axes.set_ylabel("frames")
    if inspection.rate_hz:
        axes.axvline(1e3 / inspection.rate_hz, color=_GAP, linewidth=1)
    p50, p99 = np.percentile(steps, [50, 99])
    told = f"arrival: median {p50:.2f} ms, 99 % under {p99:.2f} ms, longest {steps.max():.2f} ms"
    axes.set_title(f"{told}; red: the nominal interval", fontsize=9, loc="left")
