"""One person's calibration, a value and a TOML file: the still face, how far each site moves the rig, the jaw's hinge.

Lengths are metres. Positions and axes are in the performer's ``head``: the axes of the rig, the origin where the rig's
head joint is on this person, and the person's own size. `Performer.K` is K of the joint mapping J = J0 + K (M - M0),
with M in the performer's metres and J in the rig's. The file holds lengths to 0.1 um and angles in degrees, and leaves
out what is not known. What a calibration has measured beside (ranges, quality) and what a person has fixed by hand are
kept in it too, and are left out where there is none, so files without them still load.
"""

from __future__ import annotations

import difflib
import math
import os
import re
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from retarget.errors import OutputError
from retarget.toml_table import read_table

if TYPE_CHECKING:
    import datetime
    from collections.abc import Iterable, Mapping

    from numpy.typing import ArrayLike, NDArray

    from retarget.toml_table import Table

    Array = NDArray[np.float64]

JawMode = Literal["signed", "cosine"]
VERSION = 1
DIRECTIONS = (("left", "right"), ("up", "down"), ("forward", "back"))
"""Towards the positive side of x, y and z, and towards the negative."""
JAW_KEYS = ("axis", "pivot", "gain", "min_deg", "max_deg", "mode")
JAW_SLIDES = ("forward_m", "left_m", "right_m")
QUALITY = {
    "neutral_spread_mm": "how far the still face strayed",
    "head_residual_mm": "head markers about the rigid head",
    "head_axes_deg": "how far the motion turned the head's axes from what the shape alone told",
    "jaw_residual_mm": "chin about its arc",
    "jaw_opening_deg": "largest opening of the performer's own jaw",
    "expressions": "expressions that were made, of those asked for",
    "confidence": "mean over sites and directions",
    "held_out_mm": "error on expressions that were held out, calibrated",
    "held_out_k1_mm": "the same with K = 1",
    "held_out_scale_mm": "the same with K = the ratio of sizes",
    "held_out_warp_mm": "the same with a warp of the neutral's shape",
}
"""What the file may say of how good a calibration is, and what each number means."""


@dataclass(frozen=True, slots=True, eq=False)
class PerformerJaw:
    """The performer's hinge, and what the rig's jaw makes of its turn."""

    axis: Array
    """(3,) unit, ``head``, towards the performer's left: a positive turn about it opens the mouth."""
    pivot: Array
    """(3,) [m], ``head``: a point of the hinge."""
    gain: float
    """Turn of the rig's jaw for each radian of the performer's."""
    min_rad: float
    max_rad: float
    """Limits of the rig's turn for this performer; the rig's own hold besides."""
    mode: JawMode = "signed"
    """How the turn is read from the chin: about the hinge with its sign, or by the cosine law."""
    forward_m: float = math.nan
    left_m: float = math.nan
    right_m: float = math.nan
    """How far the performer's jaw slides, measured apart from its opening [m]; NaN where not known."""


@dataclass(frozen=True, slots=True, eq=False)
class Performer:
    """One person, calibrated for one rig."""

    name: str
    rig: str
    """Name of the rig that `scale`, `K` and `jaw` are meant for."""
    layout: str
    """Name of the layout that the calibration was recorded with."""
    date: datetime.date
    markers: tuple[str, ...]
    """(M,) unique names, in the order of the arrays here."""
    head_markers: tuple[str, ...]
    """Those of `markers` that move with the skull alone."""
    neutral: Array
    """(M, 3) [m], ``head``: the still face; a NaN row is a marker whose neutral is not known."""
    noise: Array
    """(M,) [m], standard deviation of each marker at rest; NaN where not known."""
    scale: float
    """Size of the rig over the size of the performer."""
    K: Mapping[str, Array]
    """By site, (3, 3): takes the performer's displacement to the rig's, ``head``; a site not here moves by `scale`.

    Or (2, 3, 3), where what the displacement has on the positive side of each axis is taken by the first, and what it
    has on the negative side by the second.
    """
    jaw: PerformerJaw | None
    ranges: Mapping[str, Array] = field(default_factory=dict)
    """By site, (2, 3) [m], ``head``: the farthest that was seen to the positive side of each axis, and to the negative;
    no row where not measured. The jaw's turn is taken back.
    """
    quality: Mapping[str, float] = field(default_factory=dict)
    """Numbers by the names in `QUALITY`."""
    fixed: tuple[str, ...] = ()
    """Values that a person has set and that a new calibration keeps, such as "K.browMidLeft.up" or "jaw.gain"."""

    @property
    def head_template(self) -> Array:
        """(H, 3) [m], ``head``: the neutral of `head_markers`, in that order."""
        rows = [self.markers.index(name) for name in self.head_markers]
        return np.take(self.neutral, rows, axis=0)


def gain_matrix(value: ArrayLike) -> Array:
    """(3, 3) from one factor, from one an axis (3,), or from a whole matrix (3, 3).

    (2, 3, 3) from one an axis and direction (2, 3), the positive first. ValueError for any other shape.
    """
    array: Array = np.asarray(value, float)
    if array.shape in ((), (3,), (2, 3)):
        diagonal: Array = np.eye(3) * array[..., None, :] if array.ndim else np.eye(3) * array
        return diagonal
    if array.shape == (3, 3):
        return array
    raise ValueError(f"K is one number, three, six, or three rows of three; this has the shape {array.shape}.")


def moved_by(K: Array, displacements: Array) -> Array:
    """The rig's displacements (..., 3) for the performer's, by a K (3, 3) or (2, 3, 3)."""
    if K.ndim == 2:
        return displacements @ K.T
    moved: Array = np.maximum(displacements, 0.0) @ K[0].T + np.minimum(displacements, 0.0) @ K[1].T
    return moved


def load_performer(path: str | Path) -> Performer:
    """The performer in the TOML file at `path`; InputError, with the place, for anything missing, misspelt or wrong."""
    return _performer(read_table(Path(path), "performer file"))


def save_performer(performer: Performer, path: str | Path) -> None:
    """Write `performer` to `path`, whole or not at all; OutputError where the folder does not let it."""
    path = Path(path)
    text = performer_text(performer).encode()
    try:
        descriptor, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            Path(temporary).chmod(0o644)
            Path(temporary).replace(path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise OutputError(f"The performer file {path} cannot be written: {error.strerror}.") from error


def performer_text(performer: Performer) -> str:
    """The TOML text of `performer`, for a person to read and to edit."""
    sections = [
        _identity_lines(performer),
        _quality_lines(performer.quality),
        _jaw_lines(performer.jaw),
        _gain_lines(performer.K),
    ]
    neutral, noise = (zip(performer.markers, a, strict=True) for a in (performer.neutral, performer.noise))
    positions = [(name, _vector(p, 7)) for name, p in neutral if np.isfinite(p).all()]
    noises = [(name, f"{n:.7f}") for name, n in noise if np.isfinite(n)]
    sections += [_range_lines(performer.ranges)]
    sections += [["[neutral]", *_entries(positions)], ["[noise]", *_entries(noises)] if noises else []]
    return "\n\n".join("\n".join(lines) for lines in sections if lines) + "\n"


def _identity_lines(performer: Performer) -> list[str]:
    return [
        f"version = {VERSION}",
        'units = "m"  # positions: x to the performer\'s left, y up, z out of the face',
        f"performer = {_quoted(performer.name)}",
        f"rig = {_quoted(performer.rig)}",
        f"layout = {_quoted(performer.layout)}",
        f"date = {performer.date.isoformat()}",
        f"scale = {performer.scale:.7g}  # the rig's size over the performer's",
        *([f"fixed = [{', '.join(map(_quoted, performer.fixed))}]"] if performer.fixed else []),
        f"markers = [{', '.join(map(_quoted, performer.markers))}]",
        f"head_markers = [{', '.join(map(_quoted, performer.head_markers))}]",
    ]


def _jaw_lines(jaw: PerformerJaw | None) -> list[str]:
    if jaw is None:
        return []
    slides = [(key, getattr(jaw, key)) for key in JAW_SLIDES]
    return [
        "[jaw]  # a positive turn about the axis opens the mouth",
        f"axis = {_vector(jaw.axis, 7)}",
        f"pivot = {_vector(jaw.pivot, 7)}",
        f"gain = {jaw.gain:.7g}",
        f"min_deg = {math.degrees(jaw.min_rad):.7g}",
        f"max_deg = {math.degrees(jaw.max_rad):.7g}",
        f"mode = {_quoted(jaw.mode)}  # or {' or '.join(_quoted(m) for m in get_args(JawMode) if m != jaw.mode)}",
        *(f"{key} = {_length(value)}" for key, value in slides if math.isfinite(value)),
    ]


def _quality_lines(quality: Mapping[str, float]) -> list[str]:
    lines = [f"{key} = {quality[key]:.4g}  # {meaning}" for key, meaning in QUALITY.items() if key in quality]
    return ["[quality]", *lines] if lines else []


def _range_lines(ranges: Mapping[str, Array]) -> list[str]:
    heading = "[ranges]  # how far each site went: left, up, forward, right, down, back"
    rows = ((site, f"[{', '.join(map(_length, farthest.ravel()))}]") for site, farthest in ranges.items())
    return [heading, *_entries(rows)] if ranges else []


def _gain_lines(K: Mapping[str, Array]) -> list[str]:
    heading = (
        "[K]  # one factor, [x, y, z], { left, right, up, down, forward, back }, or a 3x3 matrix; "
        "a site that is not listed moves by scale"
    )
    return [heading, *_entries((site, _gain(matrix)) for site, matrix in K.items())] if K else []


def _gain(matrix: Array) -> str:
    if matrix.ndim == 3:
        return _gain_by_direction(np.diagonal(matrix, axis1=1, axis2=2))
    diagonal = np.diag(matrix)
    if (matrix != np.diag(diagonal)).any():
        return f"[{', '.join(_significant(row) for row in matrix)}]"
    return f"{diagonal[0]:.7g}" if (diagonal == diagonal[0]).all() else _significant(diagonal)


def _gain_by_direction(factors: Array) -> str:
    """Both directions of an axis under the axis's own name where they are one."""
    parts = []
    for axis, names, values in zip("xyz", DIRECTIONS, factors.T.tolist(), strict=True):
        texts = [f"{value:.7g}" for value in values]
        parts += (
            [f"{axis} = {texts[0]}"]
            if texts[0] == texts[1]
            else [f"{n} = {t}" for n, t in zip(names, texts, strict=True)]
        )
    return f"{{ {', '.join(parts)} }}"


def _length(metres: float) -> str:
    return f"{round(metres, 7) + 0.0:.7f}"


def _entries(pairs: Iterable[tuple[str, str]]) -> list[str]:
    return [f"{key if re.fullmatch('[A-Za-z0-9_-]+', key) else _quoted(key)} = {value}" for key, value in pairs]


def _vector(values: Array, decimals: int) -> str:
    return f"[{', '.join(f'{v:.{decimals}f}' for v in np.round(values, decimals) + 0.0)}]"  # + 0.0: no minus zero


def _significant(values: Array) -> str:
    return f"[{', '.join(f'{v:.7g}' for v in values)}]"


def _quoted(text: str) -> str:
    """A TOML basic string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + re.sub(r"[\x00-\x1f\x7f]", lambda match: f"\\u{ord(match[0]):04x}", escaped) + '"'


def _performer(file: Table) -> Performer:
    version = file.get("version")
    if version != VERSION:
        raise file.wrong("version", f"is {version!r}; this program reads version {VERSION}")
    texts = ("units", "performer", "rig", "layout")
    tables = ("quality", "jaw", "K", "ranges", "neutral", "noise")
    file.only("version", *texts, "date", "scale", "fixed", "markers", "head_markers", *tables)
    if file.string("units") != "m":
        raise file.wrong("units", 'must be "m"')
    scale = file.number("scale")
    if scale <= 0:
        raise file.wrong("scale", "must be above zero")
    markers, head = file.strings("markers"), file.strings("head_markers")
    for name in head:
        if name not in markers:
            raise file.wrong("head_markers", f"names {name!r}, which is not one of the markers")
    K = _gains(file.table("K"))
    ranges = file.table("ranges")
    return Performer(
        name=file.string("performer"),
        rig=file.string("rig"),
        layout=file.string("layout"),
        date=file.date("date"),
        markers=markers,
        head_markers=head,
        neutral=_by_marker(file.table("neutral"), markers, (3,)),
        noise=_by_marker(file.table("noise"), markers, ()),
        scale=scale,
        K=K,
        jaw=_jaw(file.table("jaw")) if "jaw" in file.values else None,
        ranges={site: ranges.array(site, (6,)).reshape(2, 3) for site in ranges.values},
        quality=_quality(file.table("quality")),
        fixed=_fixed(file, K),
    )


def _gains(table: Table) -> dict[str, Array]:
    return {
        site: _directions(table.table(site))
        if isinstance(value, dict)
        else gain_matrix(table.array(site, (), (3,), (3, 3)))
        for site, value in table.values.items()
    }


def _directions(table: Table) -> Array:
    """(2, 3, 3) of a table that names each axis, or both of its directions."""
    table.only("x", "y", "z", *(name for names in DIRECTIONS for name in names))
    columns = []
    for axis, names in zip("xyz", DIRECTIONS, strict=True):
        if axis in table.values and any(name in table.values for name in names):
            raise table.wrong(axis, f"stands for {names[0]} and {names[1]}; give it or them")
        columns.append([table.number(axis)] * 2 if axis in table.values else [table.number(name) for name in names])
    return gain_matrix(np.array(columns).T)


def _quality(table: Table) -> dict[str, float]:
    table.only(*QUALITY)
    return {key: table.number(key) for key in table.values}


def _fixed(file: Table, K: Mapping[str, Array]) -> tuple[str, ...]:
    """The names of fixed values; InputError for one that names none of this file's values."""
    fixed = file.strings("fixed") if "fixed" in file.values else ()
    directions = [name for names in DIRECTIONS for name in names]
    known = {"scale", *(f"jaw.{key}" for key in JAW_KEYS if "jaw" in file.values)}
    known |= {f"K.{site}" for site in K} | {f"K.{site}.{direction}" for site in K for direction in directions}
    for name in fixed:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            advice = f"did you mean {near[0]!r}?" if near else "name a value of this file, such as 'jaw.gain'"
            raise file.wrong("fixed", f"names {name!r}, which is no value here; {advice}".rstrip("?"))
    return fixed


def _by_marker(table: Table, markers: tuple[str, ...], shape: tuple[int, ...]) -> Array:
    """One row a marker, NaN where the table has none."""
    table.only(*markers)
    rows = np.full((len(markers), *shape), np.nan)
    for i, name in enumerate(markers):
        if name in table.values:
            rows[i] = table.array(name, shape)
    return rows


def _jaw(table: Table) -> PerformerJaw:
    table.only(*JAW_KEYS, *JAW_SLIDES)
    axis = table.array("axis", (3,))
    length = np.linalg.norm(axis)
    if length < 1e-6:
        raise table.wrong("axis", "must have a direction")
    if abs(length - 1) > 1e-6:  # a person's; ours is of unit length to the digits written, and stays as it stands there
        axis = axis / length
    limits = table.number("min_deg"), table.number("max_deg")
    if not -180 <= limits[0] <= 0 <= limits[1] <= 180:
        raise table.wrong("max_deg", "and min_deg must lie on either side of 0, within 180")
    mode = table.string("mode")
    if mode not in get_args(JawMode):
        raise table.wrong("mode", f"must be {' or '.join(get_args(JawMode))}")
    return PerformerJaw(
        axis=axis,
        pivot=table.array("pivot", (3,)),
        gain=table.number("gain"),
        min_rad=math.radians(limits[0]),
        max_rad=math.radians(limits[1]),
        mode="cosine" if mode == "cosine" else "signed",
        **{key: table.number(key) for key in JAW_SLIDES if key in table.values},
    )
