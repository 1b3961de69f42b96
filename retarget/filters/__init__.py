"""Filters over time: arrays in, arrays out, one call a sample. See `retarget.filters.filter` for what they share."""

from retarget.filters.blink import BlinkTrick
from retarget.filters.filter import Filter
from retarget.filters.kalman import Kalman, VelocityKalman
from retarget.filters.mean import ExponentialMean, MovingMean
from retarget.filters.one_euro import OneEuro
from retarget.filters.pd_mass import PdGains, PdMass, SteppedPdMass

__all__ = [
    "BlinkTrick",
    "ExponentialMean",
    "Filter",
    "Kalman",
    "MovingMean",
    "OneEuro",
    "PdGains",
    "PdMass",
    "SteppedPdMass",
    "VelocityKalman",
]
