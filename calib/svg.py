"""Plots as SVG text, to stand inside a page: no file, no library, sharp at any size.

Data come in millimetres; a plot keeps its axes' proportions, so that an arc is an arc.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

MARGIN = 34.0
INK, FAINT, GRID = "#1f2933", "#9aa5b1", "#e4e7eb"


@dataclass(slots=True)
class Plot:
    """A plot in the making, `width` by `height` pixels, of the given window of the data."""

    x: tuple[float, float]
    y: tuple[float, float]
    width: float = 420.0
    height: float = 320.0
    parts: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Widen the narrower side, so that a millimetre is as long upwards as sideways."""
        across, up = self.width - 2 * MARGIN, self.height - 2 * MARGIN
        scale = min(across / (self.x[1] - self.x[0]), up / (self.y[1] - self.y[0]))
        self.x, self.y = _widened(self.x, across / scale), _widened(self.y, up / scale)
        self._grid()

    def points(self, points: ArrayLike, colour: str, radius: float = 1.5, opacity: float = 0.5) -> None:
        """Dots at (N, 2); NaN is left out."""
        at = self._at(points)
        dots = "".join(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{radius}"/>' for a, b in at.tolist())
        self.parts.append(f'<g fill="{colour}" fill-opacity="{opacity}">{dots}</g>')

    def line(self, points: ArrayLike, colour: str, width: float = 1.5, dash: str = "") -> None:
        """A line through (N, 2); NaN is left out."""
        path = " ".join(f"{a:.1f},{b:.1f}" for a, b in self._at(points).tolist())
        self.parts.append(
            f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}" '
            f'stroke-dasharray="{dash}"/>'
        )

    def text(self, at: ArrayLike, words: str, colour: str = INK, anchor: str = "start") -> None:
        """`words` at (2,)."""
        ((a, b),) = self._at(np.asarray(at, float)[None]).tolist()
        self.parts.append(
            f'<text x="{a + (4 if anchor == "start" else 0):.1f}" y="{b - 4:.1f}" fill="{colour}" '
            f'text-anchor="{anchor}">{escape(words)}</text>'
        )

    def cross(self, at: ArrayLike, colour: str, size: float = 6.0) -> None:
        """A mark at (2,)."""
        ((a, b),) = self._at(np.asarray(at, float)[None]).tolist()
        self.parts.append(
            f'<path d="M{a - size:.1f},{b:.1f}h{2 * size:.1f}M{a:.1f},{b - size:.1f}v{2 * size:.1f}" '
            f'stroke="{colour}" stroke-width="2"/>'
        )

    def svg(self, label: str) -> str:
        """The whole picture; `label` is for who cannot see it."""
        return (
            f'<svg viewBox="0 0 {self.width:g} {self.height:g}" role="img" aria-label="{escape(label)}" '
            f'font-size="11">{"".join(self.parts)}</svg>'
        )

    def _at(self, points: ArrayLike) -> Array:
        """(N, 2) in pixels."""
        p = np.asarray(points, float).reshape(-1, 2)
        p = p[np.isfinite(p).all(axis=1)]
        span = np.array([self.x[1] - self.x[0], self.y[1] - self.y[0]])
        share = (p - [self.x[0], self.y[0]]) / span
        size = np.array([self.width - 2 * MARGIN, self.height - 2 * MARGIN])
        at: Array = MARGIN + np.stack([share[:, 0], 1 - share[:, 1]], axis=1) * size
        return at

    def _grid(self) -> None:
        step = _round_step(max(self.x[1] - self.x[0], self.y[1] - self.y[0]) / 6)
        for value in np.arange(np.ceil(self.x[0] / step), np.floor(self.x[1] / step) + 1) * step:
            self.line([[value, self.y[0]], [value, self.y[1]]], GRID, 1)
            self._tick([value, self.y[0]], f"{value:g}", 0, 16)
        for value in np.arange(np.ceil(self.y[0] / step), np.floor(self.y[1] / step) + 1) * step:
            self.line([[self.x[0], value], [self.x[1], value]], GRID, 1)
            self._tick([self.x[0], value], f"{value:g}", -14, 4)

    def _tick(self, at: list[float], words: str, right: float, down: float) -> None:
        ((a, b),) = self._at(np.array([at])).tolist()
        self.parts.append(
            f'<text x="{a + right:.1f}" y="{b + down:.1f}" fill="{FAINT}" text-anchor="middle">{words}</text>'
        )


def range_bar(seen: tuple[float, float], rig: tuple[float, float], largest: float) -> str:
    """Two ranges about zero in one small bar: the rig's wide and pale, the performer's, in its size, inside it."""
    width, middle, height = 120.0, 60.0, 14.0
    scale = (middle - 2) / max(largest, 1e-9)

    def bar(span: tuple[float, float], colour: str, top: float, tall: float) -> str:
        left, right = (middle + scale * float(np.clip(v, -largest, largest)) for v in span)
        return f'<rect x="{left:.1f}" y="{top}" width="{max(right - left, 0):.1f}" height="{tall}" fill="{colour}"/>'

    return (
        f'<svg class="bar" viewBox="0 0 {width:g} {height:g}" aria-hidden="true">{bar(rig, "#cbd2d9", 1, 12)}'
        f'{bar(seen, "#2f7fc2", 4.5, 5)}<path d="M{middle},0v{height}" stroke="{INK}"/></svg>'
    )


def _widened(span: tuple[float, float], size: float) -> tuple[float, float]:
    middle = (span[0] + span[1]) / 2
    return middle - size / 2, middle + size / 2


def _round_step(step: float) -> float:
    """The next of 1, 2, 5, 10, 20 ... above."""
    power = 10.0 ** np.floor(np.log10(max(step, 1e-9)))
    return float(next(m * power for m in (1, 2, 5, 10) if m * power >= step))
