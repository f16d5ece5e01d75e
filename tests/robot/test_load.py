"""One record for every robot: the same file read both ways, and what earlier results kept of robots."""

from __future__ import annotations

import json

import msgspec
import mujoco
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.files import folder
from biped.robot.load import load_robot, robot_from
from biped.robot.planar.description import description_at
from biped.robot.planar.model import tree_at
from biped.robot.planar.tree import true_tree
from biped.robot.robot import seven_links
from biped.robot.truth import true_robot
from biped.scenario.robot import Described
from biped.scenario.world import BodyTruth, Truth
from tests.robot.planar.toy import shuffled_human

MODELS = folder("models")


@pytest.mark.parametrize("name", ["human", "robot"])
def test_seven_links_are_the_robot_that_is_recognised_in_their_file(name):
    """Two readings that share no code: the description's names and the planar tree, and what the geometry says."""
    path = MODELS / f"{name}.xml"
    one, other = load_robot(path, None), load_robot(path, Described())
    assert (one.base, one.planar, one.starts) == (other.base, other.planar, other.starts)
    assert dict(zip(one.bodies, one.masses, strict=True)) == dict(zip(other.bodies, other.masses, strict=True))
    assert (one.q_names, one.v_names) == (other.q_names, other.v_names), "the file has the canonical order"
    assert [(drive.joint, drive.place, drive.column, drive.turns) for drive in one.drives] == [
        (drive.joint, drive.place, drive.column, drive.turns) for drive in other.drives
    ]
    radius = seven_links(one).contact.radius  # of the spheres that the recognised soles are
    assert one.leg == pytest.approx(other.leg - radius, rel=1e-12)
    for mine, theirs in zip(one.feet, other.feet, strict=True):
        assert (mine.bodies, mine.pitching, mine.on) == (theirs.bodies, theirs.pitching, theirs.on)
        np.testing.assert_allclose(np.sort(mine.points, axis=0), np.sort(theirs.points, axis=0), atol=1.001 * radius)
        assert sorted(mine.geoms) == sorted(theirs.geoms)


def test_numbers_of_the_files_geoms_are_found_in_any_order(tmp_path):
    path = shuffled_human(tmp_path)
    robot, model = load_robot(path, None), mujoco.MjModel.from_xml_path(str(path))
    for foot in robot.feet:
        assert [model.geom(number).name for number in foot.geoms] == list(foot.names)
    assert model.geom(robot.ground).type[0] == mujoco.mjtGeom.mjGEOM_PLANE


@pytest.mark.parametrize("name", ["human", "robot"])
def test_results_of_before_kept_a_description_and_a_tree(name):
    path = MODELS / f"{name}.xml"
    now, tree = load_robot(path, None), {key: value.tolist() for key, value in tree_at(path)._asdict().items()}
    before = json.loads(json.dumps({"robot": msgspec.to_builtins(description_at(path)), "tree": tree}))
    found = robot_from(before["robot"], before["tree"])
    known = dict.fromkeys(("name", "starts", "ground", "feet"))
    assert msgspec.structs.asdict(found) | known == msgspec.structs.asdict(now) | known
    assert [foot.points for foot in found.feet] == [foot.points for foot in now.feet]
    for mine, theirs in zip(seven_links(found).tree, tree_at(path), strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_the_oldest_results_are_the_humans():
    tree = {key: value.tolist() for key, value in tree_at(MODELS / "human.xml")._asdict().items()}
    assert robot_from(None, tree).bodies == load_robot(MODELS / "human.xml", None).bodies


def test_what_is_kept_is_read_again():
    for table in (None, Described()):
        robot = load_robot(MODELS / "human.xml", table)
        assert robot_from(json.loads(json.dumps(msgspec.to_builtins(robot)))) == robot


def test_what_needs_seven_links_says_so():
    with pytest.raises(InputError, match="expected a planar biped of seven links"):
        seven_links(load_robot(MODELS / "human.xml", Described()))


def test_the_true_robot_is_that_of_the_true_numbers():
    """Of seven links by the true tree; of others body by body. Both are as heavy."""
    path = MODELS / "human.xml"
    links, described = load_robot(path, None), load_robot(path, Described())
    heavier = Truth(mass=(1.1, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0), length=(1.0, 1.2, 1.0, 1.0, 1.0, 1.0, 1.0))
    one = true_robot(heavier, links)
    assert one.masses[0] == pytest.approx(1.1 * links.masses[0], rel=1e-15)
    np.testing.assert_array_equal(seven_links(one).tree.joint, true_tree(tree_at(path), heavier).joint)
    assert one.leg == true_tree(tree_at(path), heavier).leg
    other = true_robot(Truth(part=(BodyTruth(name=described.bodies[0], mass=1.1),)), described)
    assert other.mass == pytest.approx(one.mass, rel=1e-15)
    assert true_robot(Truth(), links) is links
