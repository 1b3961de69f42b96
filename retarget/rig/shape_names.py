"""The table [shapes] of a rig.toml: which of a mesh's blend shapes, under which of our names, may drive.

One line a shape; a shape of ours may be the sum of several of the mesh's::

    [shapes]
    jawOpen = "Fcl_MTH_A"
    browInnerUp = { browInnerUp_L = 1.0, browInnerUp_R = 1.0 }

Where there is such a table, the mesh's other shapes stay at rest and are not shapes of the rig.
"""

from __future__ import annotations

import difflib
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from retarget.rig.model import Shape

if TYPE_CHECKING:
    from collections.abc import Mapping

    from retarget.rig.model import Surface
    from retarget.toml_table import Table

MOST = 4.0
"""Largest share of a mesh's shape in one of ours."""


def read_shape_names(table: Table, shape_names: tuple[str, ...]) -> dict[str, dict[str, float]]:
    """Our name to shares of the mesh's shapes `shape_names`; InputError where it has no such shape."""
    return {ours: _parts(table, ours, shape_names) for ours in table.values}


def _parts(table: Table, ours: str, shape_names: tuple[str, ...]) -> dict[str, float]:
    value = table.get(ours)
    if isinstance(value, dict):
        within = table.table(ours)
        parts = {theirs: within.number(theirs) for theirs in value}
    else:
        parts = {table.string(ours): 1.0}
    for theirs, share in parts.items():
        if theirs not in shape_names:
            near = difflib.get_close_matches(theirs, shape_names, n=1)
            advice = f" (did you mean {near[0]!r}?)" if near else ""
            raise table.wrong(ours, f"names the blend shape {theirs!r}, which the mesh does not have{advice}")
        if not abs(share) <= MOST:
            raise table.wrong(ours, f"must have shares between -{MOST:g} and {MOST:g}")
    return parts


def renamed(
    surfaces: tuple[Surface, ...], shape_names: tuple[str, ...], ours: Mapping[str, Mapping[str, float]]
) -> tuple[Surface, ...]:
    """The surfaces with the shapes `ours`, in that order, in the place of those named `shape_names`."""
    number = {name: b for b, name in enumerate(shape_names)}
    return tuple(
        replace(s, shapes=tuple(_sum([(s.shapes[number[n]], w) for n, w in parts.items()]) for parts in ours.values()))
        for s in surfaces
    )


def _sum(parts: list[tuple[Shape, float]]) -> Shape:
    if len(parts) == 1 and parts[0][1] == 1:
        return parts[0][0]
    vertices = np.unique(np.concatenate([np.zeros(0, np.intp), *(shape.vertices for shape, _ in parts)]))
    offsets = np.zeros((len(vertices), 3), np.float32)
    for shape, share in parts:
        offsets[np.searchsorted(vertices, shape.vertices)] += np.float32(share) * shape.offsets
    return Shape(vertices, offsets)
