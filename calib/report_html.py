"""The report as one page that needs nothing else: no script, no font, no picture from anywhere.

A supervisor reads it from the top: what to trust, what is missing, what it looks like, then the numbers.
"""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calib.jaw_plots import side_view, view_from_below
from calib.report import facts, region_facts
from calib.svg import range_bar
from retarget.performer import DIRECTIONS

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from calib.calibration import Calibration
    from calib.pictures import Extreme

STYLE = Path(__file__).parent / "report.css"
KINDS = {"missing": "not exercised", "doubt": "look here", "note": "note"}
AXES = ("sideways", "up and down", "forward and back")


def page(calibration: Calibration, extremes: Sequence[Extreme], no_pictures: str) -> str:
    """The whole page; `no_pictures` says why there are none, where there are none."""
    told = facts(calibration)
    title = f"{told['performer']} on {told['rig']}"
    sections = [
        _head(title, told),
        _findings(told["findings"]),
        _pictures(extremes, no_pictures),
        _regions(calibration),
        _jaw(calibration, told["jaw"]),
        _score(calibration),
        _expressions(told["expressions"]),
        _sites(told),
        _markers(told["markers"]),
        _method(told),
    ]
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>Calibration: {escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width"><style>{STYLE.read_text("utf-8")}</style></head>'
        f"<body><main>{''.join(sections)}</main></body></html>\n"
    )


def _head(title: str, told: dict[str, Any]) -> str:
    quality, jaw = told["quality"], told["jaw"]
    made = sum(any(e["exercised"] for e in told["expressions"] if e["name"] == name) for name in _names(told))
    cards = [
        ("expressions made", f"{made} of {len(_names(told))}"),
        ("confidence", f"{100 * quality['confidence']:.0f} %"),
        ("held-out error", f"{quality['held_out_mm']:.1f} mm" if "held_out_mm" in quality else "none held out"),
        ("jaw, times its gain", f"{jaw['opening_deg']:.0f}° × {jaw['gain']:.2f}" if jaw else "none"),
        ("head steady within", f"{quality['head_residual_mm']:.2f} mm"),
        ("neutral steady within", f"{quality['neutral_spread_mm']:.2f} mm"),
    ]
    takes = ", ".join(f"{t['name']} ({t['seconds']:.0f} s, {t['rate_hz']:.0f} Hz)" for t in told["takes"])
    shown = "".join(f"<div><b>{escape(value)}</b><span>{escape(what)}</span></div>" for what, value in cards)
    return (
        f"<header><h1>{escape(title)}</h1><p>Calibrated on {told['date']} with the layout {escape(told['layout'])} "
        f"from {escape(takes)}; neutral from {escape(told['neutral']['take'])}, {told['neutral']['from_s']:.1f} to "
        f"{told['neutral']['to_s']:.1f} s. The rig is {told['size_ratio']:.3f} times as large as the performer.</p>"
        f'<div class="cards">{shown}</div></header>'
    )


def _names(told: dict[str, Any]) -> list[str]:
    return list(dict.fromkeys(expression["name"] for expression in told["expressions"]))


def _findings(found: list[dict[str, str]]) -> str:
    if not found:
        return _section("Findings", "<p>Nothing is missing and nothing is in doubt.</p>")
    rows = "".join(
        f'<li class="{f["kind"]}"><span class="tag">{KINDS[f["kind"]]}</span>{escape(f["text"])}</li>' for f in found
    )
    return _section("Findings", f'<ul class="findings">{rows}</ul>')


def _pictures(extremes: Sequence[Extreme], why_not: str) -> str:
    if not extremes:
        reason = why_not or "No expression was made."
        return _section("Extremes, before and after", f"<p>There are no pictures. {escape(reason)}</p>")
    figures = "".join(
        f'<figure><div><img alt="{escape(e.name)} before" src="data:image/png;base64,{e.before}">'
        f'<img alt="{escape(e.name)} after" src="data:image/png;base64,{e.after}"></div>'
        f"<figcaption><b>{escape(e.name)}</b><span>before</span><span>after</span></figcaption></figure>"
        for e in extremes
    )
    text = (
        "The rig at the performer's own extremes: on the left with K the ratio of sizes and the rig's hinge, on the "
        "right calibrated. Each should look like its name."
    )
    return _section("Extremes, before and after", f'<p>{text}</p><div class="pairs">{figures}</div>')


def _regions(calibration: Calibration) -> str:
    rows = [
        [
            f"{escape(r['region'])}",
            str(r["sites"]),
            f"{r['seen_mm']:.1f}",
            f"{r['rig_mm']:.1f}",
            f"{r['K']:.2f}",
            _meter(r["confidence"]),
        ]
        for r in region_facts(calibration)
    ]
    heads = ["region", "sites", "farthest seen [mm]", "the rig goes [mm]", "middle K / size", "confidence"]
    return _section("Regions", _table(heads, rows))


def _jaw(calibration: Calibration, jaw: dict[str, Any] | None) -> str:
    if jaw is None:
        return _section("Jaw", "<p>The rig or the layout has no jaw.</p>")
    lines = [
        ("opening seen", f"{jaw['opening_deg']:.1f}°"),
        ("gain", f"{jaw['gain']:.2f} (limit {jaw['rig_limit_deg']:.1f}° on the rig)"),
        ("slides, apart from opening", _slides(jaw)),
        (
            "hinge",
            f"at {_listed(jaw['pivot_mm'], 0)} mm, axis {_listed(jaw['axis'], 3)}",
        ),
    ]
    if jaw["observed"]:
        lines.append(("known within", f"{jaw['pivot_sd_mm']:.0f} mm and {jaw['axis_sd_deg']:.1f}°"))
        lines.append(("chin off its arc", f"{jaw['residual_mm']:.1f} mm, middle"))
    facts_list = "".join(f"<dt>{what}</dt><dd>{escape(value)}</dd>" for what, value in lines)
    plots = (
        f"<figure>{side_view(calibration)}<figcaption>From the left side, face to the right [mm]. "
        '<i class="open"></i> open, <i class="closed"></i> nearly closed, dashed: the arc about the hinge.</figcaption>'
        f"</figure><figure>{view_from_below(calibration)}<figcaption>Nearly closed: to the performer's left is right, "
        "forward is up [mm].</figcaption></figure>"
    )
    return _section("Jaw", f'<dl>{facts_list}</dl><div class="plots">{plots}</div>')


def _listed(values: Iterable[float], decimals: int) -> str:
    return ", ".join(f"{value:.{decimals}f}" for value in values)


def _slides(jaw: dict[str, Any]) -> str:
    return f"forward {jaw['forward_mm']:.1f} mm, left {jaw['left_mm']:.1f} mm, right {jaw['right_mm']:.1f} mm"


def _score(calibration: Calibration) -> str:
    score = calibration.score
    if score is None:
        return _section("On what it did not see", "<p>No expression was made twice, so nothing could be held out.</p>")
    bars = [
        ("calibrated", score.calibrated),
        ("K = ratio of sizes", score.scale),
        ("warp of the neutral", score.warp),
        ("K = 1", score.one),
    ]
    largest = max(value for _, value in bars)
    rows = "".join(
        f'<div class="{"ours" if what == "calibrated" else ""}"><span>{what}</span>'
        f'<b style="width:{55 * value / largest:.1f}%"></b><em>{value:.2f} mm</em></div>'
        for what, value in bars
    )
    text = (
        f"Of {score.poses} extremes that were made more than once, one time was held out: how far from the rig's own "
        "extreme each way of mapping ends, root mean square over the sites that the rig moves there."
    )
    return _section("On what it did not see", f'<p>{text}</p><div class="bars">{rows}</div>')


def _expressions(expressions: Iterable[dict[str, Any]]) -> str:
    rows = [
        [
            escape(e["name"]),
            e["side"],
            "made" if e["exercised"] else '<b class="no">never</b>',
            f"{100 * e['strength_of_rigs']:.0f} %" if e["exercised"] else "",
            f"{e['likeness']:.2f}" if e["exercised"] else "",
        ]
        for e in expressions
    ]
    heads = ["expression", "side", "", "strength, of the rig's", "likeness"]
    return _section("Expressions", _details("All expressions", _table(heads, rows)))


def _sites(told: dict[str, Any]) -> str:
    scale = told["size_ratio"]
    largest = max((v for s in told["sites"] for v in s["rig_mm"].values()), default=1.0)
    rows = []
    for site in told["sites"]:
        row = [f"{escape(site['site'])}<small>{escape(site['marker'])}</small>"]
        for ahead, back in DIRECTIONS:
            row += [_k(site, ahead) + " / " + _k(site, back), _bar(site, ahead, back, scale, largest)]
        rows.append(row)
    heads = ["site"]
    for axis, (ahead, back) in zip(AXES, DIRECTIONS, strict=True):
        heads += [f"K {ahead} / {back}", axis]
    note = (
        "K over the ratio of sizes, for both directions of each axis; the paler a value, the less the data told of it "
        "and the more its neighbours or the default. Bars: wide and pale is how far the rig goes, narrow and blue how "
        f"far the performer went, in the rig's size; half a bar is {largest:.0f} mm."
    )
    return _section("Sites", f"<p>{note}</p>" + _table(heads, rows, "sites"))


def _k(site: dict[str, Any], direction: str) -> str:
    confidence = site["confidence"][direction] or 0.0
    return f'<span style="opacity:{0.35 + 0.65 * min(confidence, 1.0):.2f}">{site["K"][direction]:.2f}</span>'


def _bar(site: dict[str, Any], ahead: str, back: str, scale: float, largest: float) -> str:
    seen = (-scale * (site["seen_mm"][back] or 0.0), scale * (site["seen_mm"][ahead] or 0.0))
    return range_bar(seen, (-site["rig_mm"][back], site["rig_mm"][ahead]), largest)


def _markers(markers: Iterable[dict[str, Any]]) -> str:
    rows = [
        [
            escape(m["marker"]),
            escape(m["site"]),
            f"{100 * m['missing']:.1f}",
            f"{100 * m['spikes']:.1f}",
            "not seen" if m["noise_mm"] is None else f"{m['noise_mm']:.2f}",
        ]
        for m in markers
    ]
    heads = ["marker", "site", "missing [%]", "jumps [%]", "noise at rest [mm]"]
    return _section("Markers", _details("All markers", _table(heads, rows)))


def _method(told: dict[str, Any]) -> str:
    poses = ", ".join(told["reference_poses"])
    how = (
        f"Reference poses ({escape(poses)}) were mimicked; the strength of smoothing over neighbours, "
        f"{told['laplacian_strength_mm2']:.3g} mm², was chosen by leaving poses out."
        if poses
        else "No reference poses: the performer's strongest moment of each expression is taken to mean the rig's own "
        "extreme. Where a performer holds back, K comes out too large, up to its bound."
    )
    return _section(
        "How to read this",
        f"<p>{how} K stays within {told['bounds'][0]:g} and {told['bounds'][1]:g} times the ratio of sizes. The file "
        "can be edited by hand; a value named in its list <code>fixed</code>, such as <code>K.browMidLeft.up</code> or "
        "<code>jaw.gain</code>, is kept when it is calibrated again.</p>",
    )


def _section(title: str, content: str) -> str:
    return f"<section><h2>{title}</h2>{content}</section>"


def _details(title: str, content: str) -> str:
    return f"<details><summary>{title}</summary>{content}</details>"


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "") -> str:
    head = "".join(f"<th>{h}</th>" for h in heads)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return (
        f'<div class="scroll"><table class="{kind}"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
    )


def _meter(share: float) -> str:
    return f'<span class="meter"><i style="width:{100 * share:.0f}%"></i></span>{100 * share:.0f} %'
