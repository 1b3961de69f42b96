"""What a calibration found, as plain values for JSON, and as a table of ten lines for the terminal.

Lengths in millimetres, angles in degrees; K over the ratio of sizes, so that 1 means "as large as the performer's".
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from calib.expressions import REGIONS, region_of
from calib.findings import findings
from calib.fixed import by_direction
from retarget.performer import DIRECTIONS

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from rich.table import Table

    from calib.calibration import Calibration

    Array = NDArray[np.float64]

DIGITS = 3


def facts(calibration: Calibration) -> dict[str, Any]:
    """Everything, for JSON and for the page."""
    performer = calibration.performer
    return {
        "performer": performer.name,
        "rig": performer.rig,
        "layout": performer.layout,
        "date": performer.date.isoformat(),
        "takes": [_take(calibration, i) for i in range(len(calibration.material.takes))],
        "size_ratio": round(performer.scale, 4),
        "bounds": list(calibration.bounds),
        "neutral": _neutral(calibration),
        "quality": {key: round(value, DIGITS) for key, value in performer.quality.items()},
        "jaw": jaw_facts(calibration),
        "expressions": [
            {
                "name": match.name,
                "side": match.side.lower() or "both",
                "exercised": match.exercised,
                "strength_of_rigs": round(match.share, 2),
                "likeness": round(match.likeness, 2),
            }
            for match in calibration.matches
        ],
        "reference_poses": [pose.name for pose in calibration.material.poses],
        "laplacian_strength_mm2": calibration.strength,
        "sites": [site_facts(calibration, s) for s in range(len(calibration.face.names))],
        "markers": marker_facts(calibration),
        "findings": [{"kind": finding.kind, "text": finding.text} for finding in findings(calibration)],
    }


def _take(calibration: Calibration, i: int) -> dict[str, Any]:
    recording = calibration.material.takes[i].recording
    return {
        "name": recording.name,
        "seconds": round(recording.seconds, 2),
        "rate_hz": round(recording.rate_hz, 2),
        "frames": len(recording.times),
    }


def _neutral(calibration: Calibration) -> dict[str, Any]:
    still = calibration.material.neutral
    return {
        "take": still.recording,
        "from_s": round(still.start_s, 2),
        "to_s": round(still.end_s, 2),
        "frames": still.frames,
        "spread_mm": round(1e3 * still.spread_m, DIGITS),
    }


def jaw_facts(calibration: Calibration) -> dict[str, Any] | None:
    """The jaw, None where rig or layout has none."""
    jaw, fitted = calibration.performer.jaw, calibration.jaw
    if jaw is None or fitted is None:
        return None
    facts: dict[str, Any] = {
        "observed": fitted.hinge is not None,
        "axis": np.round(jaw.axis, 4).tolist(),
        "pivot_mm": np.round(1e3 * jaw.pivot, 1).tolist(),
        "gain": round(jaw.gain, DIGITS),
        "opening_deg": round(float(np.degrees(fitted.opening_rad)), 1),
        "rig_limit_deg": round(float(np.degrees(jaw.max_rad)), 1),
        "forward_mm": round(1e3 * fitted.slides.forward_m, 1),
        "left_mm": round(1e3 * fitted.slides.left_m, 1),
        "right_mm": round(1e3 * fitted.slides.right_m, 1),
    }
    if fitted.hinge:
        facts |= {
            "residual_mm": round(1e3 * fitted.hinge.residual_m, 2),
            "axis_sd_deg": round(float(np.degrees(fitted.hinge.axis_sd_rad)), 1),
            "pivot_sd_mm": round(1e3 * fitted.hinge.pivot_sd_m, 1),
        }
    return facts


def site_facts(calibration: Calibration, s: int) -> dict[str, Any]:
    """K, confidence and ranges of one site, by direction."""
    name = calibration.face.names[s]
    K = by_direction(calibration.performer.K[name]) / calibration.performer.scale
    return {
        "site": name,
        "marker": calibration.layout.names[calibration.face.markers[s]],
        "region": region_of(name),
        "K": _by_direction(K),
        "K_before_bounds": _by_direction(calibration.wanted.K[:, s] / calibration.performer.scale),
        "confidence": _by_direction(calibration.wanted.confidence[:, s]),
        "seen_mm": _by_direction(1e3 * np.abs(calibration.seen[:, s])),
        "rig_mm": _by_direction(1e3 * np.abs(calibration.rig_seen[:, s])),
    }


def marker_facts(calibration: Calibration) -> list[dict[str, Any]]:
    """How well each marker was seen."""
    performer, laid = calibration.performer, calibration.laid
    return [
        {
            "marker": name,
            "site": site or ("head" if i in calibration.layout.head else ""),
            "missing": round(float(laid.missing[i]), DIGITS),
            "spikes": round(float(laid.spikes[i]), DIGITS),
            "noise_mm": None if np.isnan(performer.noise[i]) else round(1e3 * float(performer.noise[i]), DIGITS),
        }
        for i, (name, site) in enumerate(zip(calibration.layout.names, calibration.layout.sites, strict=True))
    ]


def _by_direction(values: Array) -> dict[str, float | None]:
    """(2, 3) by the names of the directions; None for what is not known."""
    return {
        name: round(float(values[sign, axis]), DIGITS) if np.isfinite(values[sign, axis]) else None
        for axis, names in enumerate(DIRECTIONS)
        for sign, name in enumerate(names)
    }


def region_facts(calibration: Calibration) -> list[dict[str, Any]]:
    """For each region: how far it went beside the rig, the middle K and its confidence, where the rig moves at all."""
    rows = []
    names = np.array([region_of(name) for name in calibration.face.names])
    ratio = np.stack([by_direction(calibration.performer.K[n]) for n in calibration.face.names], axis=1)
    for region in dict.fromkeys([*REGIONS, *names.tolist()]):
        of = names == region
        if of.any():
            moves = np.abs(calibration.rig_seen[:, of]) > 0.001
            K = (ratio[:, of] / calibration.performer.scale)[moves]
            confidence = calibration.wanted.confidence[:, of][moves]
            rows.append(
                {
                    "region": region,
                    "sites": int(of.sum()),
                    "seen_mm": 1e3 * float(np.nanmax(np.abs(calibration.seen[:, of]), initial=0.0)),
                    "rig_mm": 1e3 * float(np.abs(calibration.rig_seen[:, of]).max(initial=0.0)),
                    "K": float(np.median(K)) if K.size else float("nan"),
                    "confidence": float(confidence.mean()) if confidence.size else 0.0,
                }
            )
    return rows


def terminal_table(calibration: Calibration) -> Table:
    """Ten lines or so: the regions, the jaw, the head, the score."""
    from rich.table import Table

    performer, quality = calibration.performer, calibration.performer.quality
    table = Table(title=f"{performer.name} on {performer.rig}", title_justify="left", box=None, pad_edge=False)
    for column in ("region", "farthest seen", "the rig goes", "K / size", "confidence"):
        table.add_column(column, justify="left" if column == "region" else "right")
    for row in region_facts(calibration):
        table.add_row(
            f"{row['region']} ({row['sites']} sites)",
            f"{row['seen_mm']:.1f} mm",
            f"{row['rig_mm']:.1f} mm",
            f"{row['K']:.2f}",
            f"{100 * row['confidence']:.0f} %",
        )
    jaw = jaw_facts(calibration)
    if jaw:
        rig_rad = next(
            (e.jaw_rad for e in calibration.extremes if e.name == "jawOpen"),
            performer.jaw.max_rad if performer.jaw else 0.0,
        )
        sure = f"± {jaw['pivot_sd_mm']:.0f} mm" if jaw["observed"] else "default"
        table.add_row(
            "jaw opens", f"{jaw['opening_deg']:.1f}°", f"{np.degrees(rig_rad):.1f}°", f"{jaw['gain']:.2f}", sure
        )
    table.add_row("head", f"{quality['head_residual_mm']:.2f} mm about rigid", "", f"{performer.scale:.3f} size", "")
    if calibration.score:
        score = calibration.score
        table.add_row(
            "held out",
            f"{score.calibrated:.2f} mm",
            f"K=1 {score.one:.2f}",
            f"size {score.scale:.2f}",
            f"warp {score.warp:.2f}",
        )
    return table
