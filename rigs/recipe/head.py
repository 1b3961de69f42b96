"""Put the head together: person, cut, skin weights, parts, shapes, pictures, file."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from retarget.geometry import apply, kabsch
from rigs.recipe import pictures
from rigs.recipe.atlas import INNER_ISLANDS, ISLANDS, island_of, pack
from rigs.recipe.binding import HEAD, JAW, NECK, Binding, Bones, Regions, bind_skin, gather
from rigs.recipe.complexion import Ground, complexion, hair_cover
from rigs.recipe.eyes import eyeball, fit_sphere
from rigs.recipe.glb import Look, Skeleton, write_glb
from rigs.recipe.identity import person
from rigs.recipe.lashes import hairs, strip_grid
from rigs.recipe.mouth import LOWER, UPPER, teeth, tongue
from rigs.recipe.occlusion import openness, smooth
from rigs.recipe.paint import Canvas, canvas, jpeg, look_up, png
from rigs.recipe.part import Part, join, vertex_normals
from rigs.recipe.refine import refine, thicken
from rigs.recipe.shapes import ARKIT, iron, looseness
from rigs.recipe.sites import LEFT, MIDDLE, rides_jaw
from rigs.recipe.skin import Skin, close, cut_head, triangulate
from rigs.recipe.weights import surface_distance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rigs.recipe.source import BaseMesh, Wheel

JAW_FROM_EYES_M = (0.0, -0.0267, -0.0555)
"""The ear-to-ear hinge in front of the ear canals, seen from the middle between the eyes."""
HEAD_FROM_EYES_M = (0.0, -0.037, -0.078)
NECK_FROM_EYES_M = (0.0, -0.108, -0.095)
CUT_ABOVE_NECK_M = 0.010
CUT_TILT_DEG = 18.0
SPLITS, LONGEST_EDGE_M = 2, 0.014
HAIR_M = 0.0035
LIPS_UP_M = (0.0009, -0.0002)
"""How far the lower and the upper lip move to shut the mouth."""
LIPS_LOOSE = 0.35
"""The shapes are ironed this much on the lips, fully on the cheeks."""
SKIN_SIZE, SKIN_QUALITY = 1024, 90
LASH = (34, 25, 21)
EYES = {"eyeLeft": "helper-l-eye", "eyeRight": "helper-r-eye"}


def build(wheel: Wheel) -> bytes:
    """The GLB file."""
    mesh = wheel.mesh()
    count = len(mesh.vertices)
    base = person(wheel, mesh)
    units = {name: wheel.face_unit(name, count) for name in ARKIT}
    body = mesh.groups == "body"
    plane = _cut_plane(mesh, base)
    skin = cut_head(base, mesh.quads[body], mesh.uv[mesh.quad_uv[body]], plane)
    for _ in range(SPLITS):
        skin = refine(skin, base, LONGEST_EDGE_M)
    skin = close(skin, base, plane[1])
    skin = _grow_hair(skin, base, eyes_of(mesh, base).mean(0))
    lowest = skin.positions(base)[:, 1].min()
    base -= [0.0, lowest, eyes_of(mesh, base)[0, 2] + HEAD_FROM_EYES_M[2]]
    sites = _sites(skin, wheel.mirror(count))
    bones = gather(wheel.bone_weights(count))
    lifted = Bones(*(skin.lift @ row for row in (bones.head, bones.jaw, bones.neck)))
    binding = bind_skin(skin.positions(base), skin.triangles, sites, lifted, _regions(skin, units))
    skin = _close_lips(skin, binding)
    positions = skin.positions(base)
    skeleton = _skeleton(mesh, base, {name: positions[vertex] for name, vertex in sites.items()})
    lip_mask = wheel.lip_mask()
    parts = [
        _skin_part(skin, base, binding, skeleton, units, _firm(skin, sites, lip_mask), _red(skin, lip_mask)),
        _eyes_part(mesh, base, skeleton, units),
        _mouth_part(mesh, base, skeleton, units),
        _lashes_part(mesh, base, skin, binding, skeleton, units),
    ]
    spots = {name: positions[vertex] - eye_middle(skeleton) for name, vertex in sites.items()}
    layer = canvas(pack(skin.uv), SKIN_SIZE)
    ground = _ground(layer, skin, positions - eye_middle(skeleton), lip_mask)
    looks = [
        Look(jpeg(layer.picture(complexion(ground, spots)), SKIN_QUALITY), 0.62),
        Look(jpeg(pictures.eye(), 92), 0.12),
        Look(jpeg(pictures.mouth(), 90), 0.35),
        Look(png(np.full((4, 4, 3), LASH, dtype=np.uint8)), 0.9, double_sided=True),
    ]
    asset = {"generator": "retarget rigs/build_human.py", "copyright": "CC0 1.0 Universal"}
    return write_glb("human", parts, looks, skeleton, tuple(ARKIT), asset)


def eye_middle(skeleton: Skeleton) -> NDArray[np.float64]:
    """The middle (3,) [m] between the two eyes."""
    return np.asarray(np.mean([skeleton.positions[skeleton.names.index(name)] for name in EYES], axis=0))


def _ground(layer: Canvas, skin: Skin, place: NDArray[np.float64], lip_mask: NDArray[np.float64]) -> Ground:
    triangles = skin.triangles
    island = island_of(skin.uv)
    inside = {entry.name: island == number for number, entry in enumerate(ISLANDS)}
    behind_lids = inside["socketLeft"] | inside["socketRight"]
    depth = surface_distance(place, triangles, np.unique(triangles[~inside["mouth"]]))
    rim = surface_distance(place, triangles, np.intersect1d(triangles[behind_lids], triangles[~behind_lids]))
    light = openness(place, triangles, vertex_normals(place, triangles))
    source_uv = layer.sample(skin.uv)
    return Ground(
        place=layer.sample(place[triangles]),
        openness=layer.sample(smooth(light, triangles, 2)[triangles]),
        lips=look_up(lip_mask, source_uv),
        source_uv=source_uv,
        mouth_m=layer.sample(depth[triangles]) * inside["mouth"][layer.triangle],
        rim_m=layer.sample(rim[triangles]),
        socket=behind_lids[layer.triangle].astype(float),
        brows=inside["face"][layer.triangle] * (layer.sample(place[triangles])[:, 2] > -0.02),
    )


def _exact_group(mesh: BaseMesh, group: str) -> NDArray[np.intp]:
    return np.unique(mesh.quads[mesh.groups == group])


def _cut_plane(mesh: BaseMesh, base: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    tilt = np.radians(CUT_TILT_DEG)
    point = base[mesh.group_vertices("joint-neck")].mean(0) + [0.0, CUT_ABOVE_NECK_M, 0.0]
    return point, np.array([0.0, np.cos(tilt), np.sin(tilt)])


def eyes_of(mesh: BaseMesh, base: NDArray[np.float64]) -> NDArray[np.float64]:
    """Centres (2, 3) [m] of the eyeballs, left and right."""
    return np.array([fit_sphere(base[_exact_group(mesh, group)])[0] for group in EYES.values()])


def _grow_hair(skin: Skin, base: NDArray[np.float64], eyes: NDArray[np.float64]) -> Skin:
    source_uv = np.zeros((skin.lift.shape[0], 2))
    source_uv[skin.triangles] = skin.uv
    return thicken(skin, base, HAIR_M * hair_cover(skin.positions(base) - eyes, source_uv))


def _close_lips(skin: Skin, binding: Binding) -> Skin:
    """Raise the lower lip and lower the upper one by a hair, as far as they follow their joints."""
    raised = sum(binding.weights[:, k] for k, name in enumerate(binding.names) if name.startswith("lipLower"))
    lowered = sum(binding.weights[:, k] for k, name in enumerate(binding.names) if name.startswith("lipUpper"))
    up = LIPS_UP_M[0] * np.asarray(raised) + LIPS_UP_M[1] * np.asarray(lowered)
    return replace(skin, offset=skin.offset + up[:, None] * [0.0, 1.0, 0.0])


def _sites(skin: Skin, mirror: NDArray[np.intp]) -> dict[str, int]:
    """The skin vertex of every site."""
    lift = skin.lift.tocoo()
    whole = lift.data == 1.0
    where = dict(zip(lift.col[whole][::-1].tolist(), lift.row[whole][::-1].tolist(), strict=True))
    sites = {name: where[vertex] for name, vertex in MIDDLE.items()}
    for name, vertex in LEFT.items():
        sites[name] = where[vertex]
        sites[name.replace("Left", "Right")] = where[int(mirror[vertex])]
    return sites


def _skeleton(mesh: BaseMesh, base: NDArray[np.float64], sites: dict[str, NDArray[np.float64]]) -> Skeleton:
    eyes = dict(zip(EYES, eyes_of(mesh, base), strict=True))
    middle = np.mean(list(eyes.values()), axis=0)
    places = {
        NECK: middle + NECK_FROM_EYES_M,
        HEAD: middle + HEAD_FROM_EYES_M,
        JAW: middle + JAW_FROM_EYES_M,
        **eyes,
        **sites,
    }
    names = tuple(places)
    parents = {NECK: -1, HEAD: 0} | {site: names.index(JAW) for site in sites if rides_jaw(site)}
    return Skeleton(names, tuple(parents.get(name, 1) for name in names), np.array(list(places.values())))


def _firm(skin: Skin, sites: dict[str, int], lip_mask: NDArray[np.float64]) -> NDArray[np.intp]:
    """Vertices about which the shapes keep their detail: the red of the lips, the mouth, the sockets, nose and brows."""
    inside = np.unique(skin.triangles[island_of(skin.uv) >= INNER_ISLANDS])
    fine = [vertex for name, vertex in sites.items() if name.startswith(("lip", "lid", "eye", "nose", "brow"))]
    return np.unique(np.concatenate([np.flatnonzero(_red(skin, lip_mask)), inside, fine]))


def _red(skin: Skin, lip_mask: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(V,) the vertices on the red of the lips."""
    red = np.zeros(skin.lift.shape[0], dtype=bool)
    red[skin.triangles] = look_up(lip_mask, skin.uv.reshape(-1, 2)).reshape(-1, 3) > 0.5
    return red


def _regions(skin: Skin, units: dict[str, NDArray[np.float64]]) -> Regions:
    island = island_of(skin.uv)
    inside = {}
    for number, entry in enumerate(ISLANDS):
        only = np.zeros(skin.lift.shape[0], dtype=bool)
        only[skin.triangles[island == number]] = True
        only[skin.triangles[island != number]] = False
        inside[entry.name] = only
    lids = {f"lidUpper{side}": np.linalg.norm(skin.lift @ units[f"eyeBlink{side}"], axis=1) for side in ("Left", "Right")}
    return Regions(inside["mouth"], inside["socketLeft"] | inside["socketRight"], lids)


def _skin_part(
    skin: Skin,
    base: NDArray[np.float64],
    binding: Binding,
    skeleton: Skeleton,
    units: dict[str, NDArray[np.float64]],
    firm: NDArray[np.intp],
    red: NDArray[np.bool_],
) -> Part:
    """The skin with a vertex for every (place, texture coordinate) pair."""
    positions = skin.positions(base)
    normals = vertex_normals(positions, skin.triangles)
    corners = np.column_stack([skin.triangles.reshape(-1, 1), np.round(pack(skin.uv).reshape(-1, 2), 6)])
    unique, index = np.unique(corners, axis=0, return_inverse=True)
    vertex = unique[:, 0].astype(int)
    joints, weights = _rig_influences(binding, skeleton)
    loose = np.maximum(looseness(positions, skin.triangles, firm), LIPS_LOOSE * red)
    shapes = {name: iron(skin.lift @ offsets, skin.triangles, loose)[vertex] for name, offsets in units.items()}
    return Part(
        "skin",
        positions[vertex],
        normals[vertex],
        unique[:, 1:],
        index.reshape(-1, 3),
        joints[vertex],
        weights[vertex],
        shapes,
    )


def _rig_influences(binding: Binding, skeleton: Skeleton) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    joints, weights = binding.influences()
    number = np.array([skeleton.names.index(name) for name in binding.names])
    return np.where(weights > 0, number[joints], 0), weights


def _eyes_part(
    mesh: BaseMesh, base: NDArray[np.float64], skeleton: Skeleton, units: dict[str, NDArray[np.float64]]
) -> Part:
    parts = []
    for name, group in EYES.items():
        vertices = _exact_group(mesh, group)
        moved = {
            shape: base[vertices] + offsets[vertices] for shape, offsets in units.items() if offsets[vertices].any()
        }
        parts.append(eyeball(name, base[vertices], moved, skeleton.names.index(name)))
    return join("eyes", parts)


def _mouth_part(
    mesh: BaseMesh, base: NDArray[np.float64], skeleton: Skeleton, units: dict[str, NDArray[np.float64]]
) -> Part:
    head, jaw = skeleton.names.index(HEAD), skeleton.names.index(JAW)
    helpers = {which: _exact_group(mesh, f"helper-{which}-teeth") for which in ("upper", "lower")}
    edge = base[helpers["upper"]].min(0)[1] - 0.0024
    front = base[helpers["upper"]].max(0)[2] - 0.0004
    top = teeth("upperTeeth", UPPER, np.array([0.0, edge, front]), head)
    bottom = teeth("lowerTeeth", LOWER, np.array([0.0, edge + 0.0012, front - 0.0026]), jaw)
    bottom = _follow(
        bottom, base[helpers["lower"]], {name: offsets[helpers["lower"]] for name, offsets in units.items()}
    )
    vertices = _exact_group(mesh, "helper-tongue")
    quads = np.searchsorted(vertices, mesh.quads[mesh.groups == "helper-tongue"])
    at = base[vertices]
    triangles = np.take_along_axis(quads[:, None, :], triangulate(quads, at), axis=2).reshape(-1, 3)
    moved = {name: offsets[vertices] for name, offsets in units.items() if offsets[vertices].any()}
    return join("mouth", [top, bottom, tongue(at, triangles, jaw, moved)])


def _follow(part: Part, helper: NDArray[np.float64], offsets: dict[str, NDArray[np.float64]]) -> Part:
    """The part with the rigid motion that each shape gives to the helper (N, 3) [m] in its place."""
    shapes = {}
    for name, moved in offsets.items():
        if moved.any():
            shapes[name] = apply(kabsch(helper, helper + moved), part.positions) - part.positions
    return replace(part, shapes=shapes)


def _lashes_part(
    mesh: BaseMesh,
    base: NDArray[np.float64],
    skin: Skin,
    binding: Binding,
    skeleton: Skeleton,
    units: dict[str, NDArray[np.float64]],
) -> Part:
    from scipy.spatial import cKDTree

    rng = np.random.default_rng(7)
    tree = cKDTree(skin.positions(base))
    near = tree.query(base)[0]
    joints, weights = _rig_influences(binding, skeleton)
    parts = []
    for side in "lr":
        for strip, count, length in (("1", 26, 0.4), ("2", 38, 0.6)):
            grid = strip_grid(mesh.quads[mesh.groups == f"helper-{side}-eyelashes-{strip}"], near)
            lift, triangles = hairs(grid, count, length, len(base), rng)
            at = lift @ base
            skin_vertex = tree.query(at)[1]
            parts.append(
                Part(
                    "lashes",
                    at,
                    vertex_normals(at, triangles),
                    np.full((len(at), 2), 0.5),
                    triangles,
                    joints[skin_vertex],
                    weights[skin_vertex],
                    {name: lift @ offsets for name, offsets in units.items()},
                )
            )
    return join("lashes", parts)
