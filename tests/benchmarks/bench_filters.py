"""Lag, jitter, blink floor and amplitude of every smoother, at four rates, with packets lost and doubled.

The signals are those that tell smoothers apart on a face: the openness of an eye, 0.2 with blinks of 150 ms, and a jaw
that talks at 3.5 Hz half of the time, 0.092 either way; white noise of 0.012 on both. One in twenty packets is lost and
one in fifty comes twice. Jitter is the deviation of the second difference on still parts over that of the raw signal,
lag the shift that correlates best with the truth, the floor the mean of the lowest values of all blinks, where the
truth is 0, the amplitude what is left of the jaw's swing. RMSE is taken when a packet arrives, all else as it is shown
until the next.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from retarget.filters import (
    BlinkTrick,
    ExponentialMean,
    Kalman,
    OneEuro,
    PdGains,
    PdMass,
    SteppedPdMass,
    VelocityKalman,
)
from tests.benchmarks.report import Row, seconds_per_call

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

RATES_HZ = (24.0, 30.0, 60.0, 120.0)
SECONDS = 24.0
NOISE = 0.012
OPEN = 0.2
SWING = 0.092
BLINKS_S = np.arange(2.0, SECONDS - 1, 2.5)
GRID_HZ = 960.0
LOST, DOUBLED = 0.05, 0.02


_START = np.array([OPEN, 0.0])
_ONLY_EYES = np.array([0.07, -np.inf])


class Smoother(Protocol):
    def __call__(self, values: Array, time_s: float, /) -> Array: ...


class _Raw:
    def __call__(self, values: Array, _time_s: float, /) -> Array:
        return values


class _Peer:
    """PyPI OneEuroFilter, one for each signal."""

    def __init__(self, beta: float) -> None:
        peer = importlib.import_module("OneEuroFilter")
        self._filters = [peer.OneEuroFilter(60.0, 1.0, beta, 1.0) for _ in range(2)]

    def __call__(self, values: Array, time_s: float, /) -> Array:
        return np.array([f(float(v), 1.0 + time_s) for f, v in zip(self._filters, values, strict=True)])


SMOOTHERS: dict[str, Callable[[], Smoother]] = {
    "raw": _Raw,
    "OpenVHead's PD, M 1, no trick, a packet an update": lambda: SteppedPdMass(PdGains(alpha=0.8), _START),
    "PD, M 1, alpha 0.8, true time, no trick": lambda: PdMass(PdGains(alpha=0.8)),
    "PD, M 1, alpha 0.8, true time, blink trick": lambda: BlinkTrick(PdMass(PdGains(alpha=0.8)), _ONLY_EYES),
    "PD, M 2, alpha 0.8, true time, no trick": lambda: PdMass(PdGains(mass=2.0, alpha=0.8)),
    "mean, 0.27 at 60 Hz": lambda: ExponentialMean.of_gain(0.27, 60.0),
    "Kalman, 8e-3 / 5e-4 a packet": lambda: Kalman(8e-3, 5e-4, per="sample"),
    "Kalman with a speed, q 30": lambda: VelocityKalman(30.0, NOISE**2),
    "One-Euro 1 Hz, beta 0": lambda: OneEuro(1.0, 0.0),
    "One-Euro 1.5 Hz, beta 8": lambda: OneEuro(1.5, 8.0),
    "One-Euro 1 Hz, beta 20 (the default, for this range)": lambda: OneEuro(1.0, 20.0),
    "PyPI OneEuroFilter 0.2.1, 1 Hz, beta 20": lambda: _Peer(20.0),
}


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """What arrives: packets in order, some lost, some twice."""

    times: Array
    """(T,) [s]."""
    noisy: Array
    """(T, 2): eye and jaw."""


@dataclass(frozen=True, slots=True)
class Score:
    """How a smoother did."""

    eye_jitter: float
    eye_lag_ms: float
    eye_rmse: float
    blink_floor: float
    jaw_jitter: float
    jaw_lag_ms: float
    jaw_rmse: float
    jaw_amplitude: float


def rows() -> Iterator[Row]:
    """For each rate and smoother: everything in words, the RMSE as the number; then the time of a call."""
    for rate_hz in RATES_HZ:
        stream = packets(rate_hz, np.random.default_rng(0))
        for name, make in SMOOTHERS.items():
            s = score(make(), stream)
            eye = f"eye: jitter {s.eye_jitter:.3f}, lag {s.eye_lag_ms:.0f} ms, floor {s.blink_floor:.3f}"
            jaw = f"jaw: jitter {s.jaw_jitter:.3f}, lag {s.jaw_lag_ms:.0f} ms, amplitude {s.jaw_amplitude:.2f}"
            yield Row(f"{rate_hz:.0f} Hz, {name}\n  {eye}, RMSE", s.eye_rmse, "")
            yield Row(f"  {jaw}, RMSE", s.jaw_rmse, "")
    yield _time_row("One-Euro", OneEuro())
    yield _time_row("PD in true time", PdMass(PdGains()))


def truth(times: Array) -> Array:
    """(T, 2): eye and jaw without noise."""
    from_blink = np.abs(times[:, None] - BLINKS_S).min(axis=1)
    eye = OPEN * np.clip((from_blink - 0.02) / 0.055, 0.0, 1.0)
    talking = (times % 4.0) < 2.0
    jaw = np.where(talking, SWING * np.sin(2 * np.pi * 3.5 * times), 0.0)
    return np.stack([eye, jaw], axis=1)


def packets(rate_hz: float, rng: np.random.Generator) -> Stream:
    """The stream at this rate, the same for every smoother."""
    times = np.arange(round(SECONDS * rate_hz)) / rate_hz
    times = times[rng.random(len(times)) >= LOST]
    noisy = truth(times) + rng.normal(scale=NOISE, size=(len(times), 2))
    copies = 1 + (rng.random(len(times)) < DOUBLED)
    return Stream(np.repeat(times, copies), np.repeat(noisy, copies, axis=0))


def score(smoother: Smoother, stream: Stream) -> Score:
    """Everything about one run, on a fine grid on which every value stays until the next comes."""
    smooth = np.array([smoother(v, t) for v, t in zip(stream.noisy, stream.times.tolist(), strict=True)])
    grid = np.arange(2.0, SECONDS, 1 / GRID_HZ)
    newest = np.searchsorted(stream.times, grid, side="right") - 1
    shown, raw, true = smooth[newest], stream.noisy[newest], truth(grid)
    lags = [_lag_s(shown[:, k], raw[:, k], true[:, k]) for k in range(2)]
    settled = stream.times > 2.0
    rmse = np.sqrt(((smooth - truth(stream.times))[settled] ** 2).mean(axis=0))
    jitter = [_jitter(smooth[:, k], stream.noisy[:, k], stream.times, k) for k in range(2)]
    floors = [shown[np.abs(grid - at) < 0.15, 0].min() for at in BLINKS_S[1:]]
    talking = (grid % 4.0 > 0.3) & (grid % 4.0 < 2.0)
    return Score(
        eye_jitter=jitter[0],
        eye_lag_ms=1000 * lags[0],
        eye_rmse=float(rmse[0]),
        blink_floor=float(np.mean(floors)),
        jaw_jitter=jitter[1],
        jaw_lag_ms=1000 * lags[1],
        jaw_rmse=float(rmse[1]),
        jaw_amplitude=float(_swing(shown[talking, 1]) / _swing(raw[talking, 1])),
    )


def _lag_s(shown: Array, raw: Array, true: Array) -> float:
    """By cross-correlation with the truth, beyond that of the raw signal, which waits for its packets too."""
    return _best_shift(shown, true) - _best_shift(raw, true)


def _best_shift(late: Array, true: Array) -> float:
    shifts = np.arange(round(0.5 * GRID_HZ))
    centred, late = true - true.mean(), late - late.mean()
    products = [float(centred[: len(true) - s] @ late[s:]) / (len(true) - s) for s in shifts]
    return float(shifts[int(np.argmax(products))] / GRID_HZ)


def _jitter(smooth: Array, noisy: Array, times: Array, signal: int) -> float:
    still = np.abs(times[:, None] - BLINKS_S).min(axis=1) > 0.6 if signal == 0 else times % 4.0 > 2.6
    ratio: float = np.diff(smooth, 2)[still[2:]].std() / np.diff(noisy, 2)[still[2:]].std()
    return ratio


def _swing(signal: Array) -> float:
    """Root mean square about the mean, which noise hardly changes and a lost peak does."""
    return float(np.std(signal))


def _time_row(name: str, smoother: Smoother) -> Row:
    signals = np.random.default_rng(0).normal(size=(100, 160))
    clock = iter(range(10**9))

    def call() -> Array:
        i = next(clock)
        return smoother(signals[i % 100], i / 60)

    return Row(f"{name}, 160 signals, a call", 1e6 * seconds_per_call(call), "us", aim="< 100")
