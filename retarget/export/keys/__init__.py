"""Key-frame reduction: a dense recording becomes few keys of the cubic curve that the target program evaluates."""

from retarget.export.keys.averaging import average_keys
from retarget.export.keys.curve import Curve
from retarget.export.keys.distance import angle_deg, euclidean
from retarget.export.keys.fitting import fit_curves
from retarget.export.keys.lines import line_keys
from retarget.export.keys.report import KeyReport, report_keys
from retarget.export.keys.slopes import central_slopes, smooth_curve
from retarget.export.keys.tracks import Tolerances, Tracks, fit_tracks
from retarget.export.keys.trembling import steady_keys

__all__ = [
    "Curve",
    "KeyReport",
    "Tolerances",
    "Tracks",
    "angle_deg",
    "average_keys",
    "central_slopes",
    "euclidean",
    "fit_curves",
    "fit_tracks",
    "line_keys",
    "report_keys",
    "smooth_curve",
    "steady_keys",
]
