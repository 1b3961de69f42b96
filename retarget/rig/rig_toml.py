"""Writing a rig.toml for a model that has been adopted; read back by `retarget.rig.load`."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

JAW_DEG = (-2.0, 25.0)


@dataclass(frozen=True, slots=True)
class Plan:
    """What is known of the model; the sites are filled in last."""

    name: str
    mesh: str
    faces: str
    joints: dict[str, str]
    """Role to joint, `jaw` among them."""
    shapes: dict[str, dict[str, float]]
    """Our name to shares of the mesh's shapes."""
    approximate: list[str]
    """Those of `shapes` that are only the nearest."""
    site_joints: dict[str, str] = field(default_factory=dict)
    site_places: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    """(3,) [m], ``rig``."""
    licence: dict[str, str] = field(default_factory=dict)


def rig_toml(plan: Plan) -> str:
    """The text of the file."""
    lines = [
        "# Made by `retarget rigs add`; edit it where it is wrong.",
        "version = 1",
        f"name = {_text(plan.name)}",
        f"mesh = {_text(plan.mesh)}",
        f"faces = {_text(plan.faces)}  # where the character looks in the mesh",
        "",
        "[joints]",
        *(f"{role} = {_text(joint)}" for role, joint in plan.joints.items() if role != "jaw"),
        *_jaw(plan),
        *_sites(plan),
        *_shapes(plan),
        *(["", "[licence]"] + [f"{key} = {_text(text)}" for key, text in plan.licence.items()] if plan.licence else []),
    ]
    return "\n".join(lines) + "\n"


def _jaw(plan: Plan) -> list[str]:
    if "jaw" not in plan.joints:
        return []
    least, most = JAW_DEG
    return [
        "",
        "# A positive turn about `axis` (frame head, +X to the character's left) opens the mouth.",
        "[jaw]",
        f"joint = {_text(plan.joints['jaw'])}",
        "axis = [1.0, 0.0, 0.0]",
        f"min_deg = {least}",
        f"max_deg = {most}",
    ]


def _sites(plan: Plan) -> list[str]:
    if not plan.site_joints and not plan.site_places:
        return []
    places = {site: [round(float(x), 5) for x in place] for site, place in plan.site_places.items()}
    return [
        "",
        "# The joint that a marker there drives, or the place on the mesh [m] where it is.",
        "[sites]",
        *(f"{site} = {_text(joint)}" for site, joint in plan.site_joints.items()),
        *(f"{site} = {place}" for site, place in places.items()),
    ]


def _shapes(plan: Plan) -> list[str]:
    if not plan.shapes:
        return []
    lines = [
        "",
        "# ARKit's name of a blend shape, and the mesh's own; those that are not here stay at rest.",
        "[shapes]",
    ]
    for ours, parts in plan.shapes.items():
        value = _parts(parts)
        lines.append(f"{ours} = {value}" + ("  # only the nearest" if ours in plan.approximate else ""))
    return lines


def _parts(parts: dict[str, float]) -> str:
    if len(parts) == 1 and next(iter(parts.values())) == 1:
        return _text(next(iter(parts)))
    return "{ " + ", ".join(f"{_text(theirs)} = {float(share)}" for theirs, share in parts.items()) + " }"


def _text(value: str) -> str:
    """A TOML basic string; JSON's escapes are among TOML's."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
