"""What the shapes make of the sites, against the vertices that skinning really moves."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from retarget.errors import InputError
from retarget.rig.load import load_rig
from retarget.rig.posing import rest_pose
from retarget.rig.site_shapes import site_shapes
from retarget.rig.skinning import Skin
from tests.synthetic.rig import small_rig

if TYPE_CHECKING:
    from retarget.rig.model import Rig
    from retarget.rig.site_shapes import SiteShapes


@cache
def human() -> Rig:
    return load_rig("human")


@cache
def all_sites() -> SiteShapes:
    return site_shapes(human(), tuple(human().sites))


@pytest.mark.parametrize("shape", ["jawOpen", "mouthSmileLeft", "browInnerUp", "eyeBlinkRight"])
def test_a_site_moves_as_the_skin_there_does_when_the_rig_is_posed(shape: str) -> None:
    """Within the span of the vertices that skinning puts within 4 mm of the site, for every site."""
    rig, seen = human(), all_sites()
    skin, rest = Skin(rig), rest_pose(rig)
    weights = np.zeros(len(rig.shape_names))
    b = rig.shape_names.index(shape)
    weights[b] = 1.0
    before = skin.positions(rest)
    moves = skin.positions(replace(rest, weights=weights)) - before
    face = slice(0, len(rig.surfaces[0].positions))
    for s, name in enumerate(seen.sites):
        place = rig.joints.T_rig_joint[rig.sites[name].joint, :3, 3]
        apart = np.linalg.norm(before[face] - place, axis=1)
        near = moves[face][apart <= max(0.008, 1.5 * apart.min())]
        assert (seen.displacements[s, :, b] >= near.min(axis=0) - 1e-5).all()
        assert (seen.displacements[s, :, b] <= near.max(axis=0) + 1e-5).all()


def test_shapes_do_what_their_names_say_and_on_their_side() -> None:
    seen = all_sites()

    def move(site: str, shape: str) -> list[float]:
        move: list[float] = (
            1000 * seen.displacements[seen.sites.index(site), :, seen.shape_names.index(shape)]
        ).tolist()
        return move  # mm

    assert move("chin", "jawOpen")[1] < -15
    assert abs(move("lipUpper", "jawOpen")[1]) < 0.3 * abs(move("lipLower", "jawOpen")[1])
    assert move("lipCornerLeft", "mouthSmileLeft")[0] > 2
    assert np.linalg.norm(move("lipCornerRight", "mouthSmileLeft")) < 1
    assert move("browInnerRight", "browInnerUp")[1] > 2
    assert move("lidUpperLeft", "eyeBlinkLeft")[1] < -2


def test_left_and_right_mirror_each_other() -> None:
    seen = all_sites()
    left = [b for b, name in enumerate(seen.shape_names) if name.endswith("Left") and not name.startswith("jaw")]
    for b in left:
        other = seen.shape_names.index(seen.shape_names[b].replace("Left", "Right"))
        for s, site in enumerate(seen.sites):
            mirrored = seen.sites.index(site.replace("Left", "*").replace("Right", "Left").replace("*", "Right"))
            np.testing.assert_allclose(
                seen.displacements[s, :, b], seen.displacements[mirrored, :, other] * [-1, 1, 1], atol=5e-4
            )


def test_a_rig_without_shapes_is_refused() -> None:
    with pytest.raises(InputError, match="no blend shapes"):
        site_shapes(replace(human(), shape_names=()), ("chin",))


def test_a_rig_without_a_surface_is_refused() -> None:
    with pytest.raises(InputError, match="surface"):
        site_shapes(small_rig(), ("chin",))
