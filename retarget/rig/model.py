"""What a rig is, once it is loaded: joints, skin, blend shapes, sites and the jaw.

Frame ``rig`` is that of the mesh file (glTF: right-handed, +Y up, +Z out of the face, +X to the character's left, in
metres). Frame ``head`` has the axes of ``rig`` and its origin at the rest position of the head joint.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from retarget.filters import PdGains
    from retarget.rig.responses import Response


@dataclass(frozen=True, slots=True, eq=False)
class Joints:
    """The skeleton at rest; parents stand before their children."""

    names: tuple[str, ...]
    parents: NDArray[np.intp]
    """(J,), -1 for a root."""
    translations: NDArray[np.float64]
    """(J, 3) [m], relative to the parent."""
    rotations: NDArray[np.float64]
    """(J, 4) xyzw, relative to the parent."""
    T_rig_joint: NDArray[np.float64]
    """(J, 4, 4), the same at rest in ``rig``."""
    T_joint_mesh: NDArray[np.float64]
    """(J, 4, 4) inverse bind matrices: bind-pose mesh coordinates to the joint's; NaN where no skin uses the joint."""

    def index(self, name: str) -> int:
        """Position of the joint `name`; ValueError where there is none."""
        return self.names.index(name)


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """How a part of the surface looks: its colour, and an optional picture that multiplies it."""

    base_color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    """Linear RGBA in [0, 1]."""
    texture: NDArray[np.uint8] | None = None
    """(H, W, 4) sRGB with alpha."""
    roughness: float = 0.8
    metallic: float = 0.0
    alpha_mode: str = "OPAQUE"
    """OPAQUE, MASK or BLEND, as in glTF."""
    double_sided: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """One blend shape on one surface, kept sparse."""

    vertices: NDArray[np.intp]
    """(S,) the vertices that it moves."""
    offsets: NDArray[np.float32]
    """(S, 3) [m] at weight 1."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A piece of the mesh that is drawn with one material (a glTF primitive)."""

    name: str
    positions: NDArray[np.float32]
    """(V, 3) [m], bind pose, ``rig``."""
    normals: NDArray[np.float32]
    """(V, 3), unit."""
    triangles: NDArray[np.int32]
    """(F, 3), counter-clockwise seen from outside."""
    joints: NDArray[np.intp]
    """(V, I) indices into the rig's joints."""
    joint_weights: NDArray[np.float32]
    """(V, I), rows add up to 1."""
    shapes: tuple[Shape, ...]
    """(B,), in the order of the rig's `shape_names`; a shape that leaves this surface alone has no vertices."""
    material: Material
    uv: NDArray[np.float32] | None = None
    """(V, 2), glTF convention: (0, 0) is the picture's upper left corner."""
    colors: NDArray[np.float32] | None = None
    """(V, 4) linear RGBA that multiplies the material's colour."""


@dataclass(frozen=True, slots=True, eq=False)
class Site:
    """A place on the face that a marker can drive: a joint, and what carries it."""

    name: str
    joint: int
    rides_jaw: bool
    """True where the joint is below the jaw in the hierarchy, so that the jaw's turn already moves it."""
    rest: NDArray[np.float64]
    """(3,) [m], ``head``."""


@dataclass(frozen=True, slots=True, eq=False)
class Jaw:
    """The hinge of the mandible."""

    joint: int
    axis: NDArray[np.float64]
    """(3,) unit, ``head``: a positive turn (right-hand rule) opens the mouth, so it points to the character's left."""
    pivot: NDArray[np.float64]
    """(3,) [m], ``head``."""
    min_rad: float
    max_rad: float


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """A face that can be driven."""

    name: str
    path: Path
    joints: Joints
    surfaces: tuple[Surface, ...]
    shape_names: tuple[str, ...]
    sites: dict[str, Site]
    head_joint: int
    neck_joint: int | None
    eye_joints: tuple[int | None, int | None]
    """Left and right."""
    jaw: Jaw | None
    licence: dict[str, str] = field(default_factory=dict)
    """What rig.toml says of licence, source and authors."""
    responses: Mapping[str, Response] = field(default_factory=dict)
    """By shape: the measure of the face that drives it; empty where rig.toml says nothing of it."""
    secondary: Mapping[int, PdGains] = field(default_factory=dict)
    """By joint: how it trails after the motion of the head, as hair and pendants do."""
