"""How far the shipped rig goes, and a rig that tells nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from calib.expressions import EXPRESSIONS
from calib.rig_range import RigRange
from retarget.rig.posing import rest_pose
from retarget.rig.skinning import Skin
from tests.synthetic.rig import small_rig

if TYPE_CHECKING:
    from retarget.rig.model import Rig

SITES = ("lipCornerLeft", "lipCornerRight", "browMidLeft", "browMidRight", "chin", "chinLeft", "lipUpper", "forehead")


@pytest.fixture(scope="module")
def reach(human: Rig) -> RigRange:
    return RigRange(human, SITES)


def test_every_expression_that_is_asked_for_can_be_shown_by_the_shipped_rig(human: Rig) -> None:
    names = [extreme.name for extreme in RigRange(human, tuple(human.sites)).extremes()]
    assert names == [expression.name for expression in EXPRESSIONS]


def test_a_site_moves_as_the_skin_there_does(human: Rig, reach: RigRange) -> None:
    weights = dict.fromkeys(("mouthSmileLeft", "mouthSmileRight"), 1.0)
    smile = reach.extreme("smile", weights)
    assert smile is not None
    pose = rest_pose(human)
    pose.weights[[human.shape_names.index(shape) for shape in weights]] = 1.0
    skin = Skin(human)
    before, after = skin(rest_pose(human)).positions[0], skin(pose).positions[0]
    head = human.joints.T_rig_joint[human.head_joint, :3, 3]
    for site, move in zip(SITES, smile.moves, strict=True):
        vertex = int(np.argmin(np.linalg.norm(before - (human.sites[site].rest + head), axis=1)))
        np.testing.assert_allclose(move, after[vertex] - before[vertex], atol=5e-4)


def test_the_smile_goes_up_and_outwards_and_leaves_the_brows(reach: RigRange) -> None:
    smile = reach.extreme("smile", {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0})
    assert smile is not None
    moves = dict(zip(SITES, 1e3 * smile.moves, strict=True))
    assert moves["lipCornerLeft"][0] > 4
    assert moves["lipCornerRight"][0] < -4
    assert min(moves["lipCornerLeft"][1], moves["lipCornerRight"][1]) > 6
    assert np.abs(moves["browMidLeft"]).max() < 0.3
    assert smile.jaw_rad == 0


def test_the_mouth_opens_by_the_hinge_and_the_chin_has_nothing_left_of_it(human: Rig, reach: RigRange) -> None:
    opened = reach.extreme("jawOpen", {"jawOpen": 1.0})
    assert opened is not None
    assert human.jaw is not None
    assert np.radians(10) < opened.jaw_rad == reach.jaw_rad <= human.jaw.max_rad
    chin = [SITES.index("chin"), SITES.index("chinLeft")]
    np.testing.assert_allclose(opened.moves[chin], 0.0, atol=1e-9)
    assert opened.moves[SITES.index("lipCornerLeft"), 1] < -0.003


def test_what_the_performer_wears_does_not_change_what_the_rig_does(human: Rig) -> None:
    alone, all_sites = RigRange(human, ("chin",)), RigRange(human, tuple(human.sites))
    assert alone.jaw_rad == all_sites.jaw_rad


def test_a_slide_of_the_jaw_is_no_opening(reach: RigRange) -> None:
    for name in ("jawLeft", "jawRight", "jawForward"):
        slide = reach.extreme(name, {name: 1.0})
        assert slide is not None
        assert slide.jaw_rad == 0
        assert np.linalg.norm(slide.moves[SITES.index("chin")]) > 0.004


def test_unknown_shapes_and_shapes_that_move_no_site_are_no_extreme(reach: RigRange) -> None:
    assert reach.extreme("x", {"noSuchShape": 1.0}) is None
    assert reach.extreme("tongueOut", {"tongueOut": 1.0}) is None


def test_a_rig_of_joints_alone_tells_only_its_jaws_limit() -> None:
    rig = small_rig()
    reach = RigRange(rig, tuple(rig.sites))
    assert reach.extremes() == []
    assert rig.jaw is not None
    assert reach.jaw_rad == rig.jaw.max_rad
    assert RigRange(replace(rig, jaw=None), tuple(rig.sites)).jaw_rad == 0
