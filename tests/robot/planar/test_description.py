"""A robot's description: what it must say, what it says of scenarios, and where it is found."""

from __future__ import annotations

from itertools import pairwise

import pytest

from biped.base.errors import InputError
from biped.base.files import description_of, folder, read_toml
from biped.ensemble.plan import Plan
from biped.robot.planar.description import description_at
from biped.robot.planar.model import tree_at
from biped.robot.planar.topology import CHAINS, INWARD, PARENT, POINT_LINK
from biped.scenario.devices import Actuation
from biped.scenario.keys import Backstep, Scenario
from biped.scenario.reading import read_scenario, to_toml
from tests.robot.planar.toy import DESCRIPTION, make, shuffled_human

HUMAN = folder("models") / "human.xml"


def test_a_model_file_alone_is_a_variant_of_the_human(tmp_path):
    assert description_at(shuffled_human(tmp_path)) == description_at(HUMAN)
    assert description_of(make(tmp_path)) == tmp_path / "toy.toml"


def test_the_tree_is_a_torso_with_two_legs():
    assert PARENT == (-1, 0, 1, 2, 0, 4, 5)
    for chain in CHAINS:
        assert all(PARENT[below] == above for above, below in pairwise(chain))
    assert all(INWARD.index(link) < INWARD.index(up) for link, up in enumerate(PARENT) if up >= 0)
    robot = description_at(HUMAN)
    for point, link in zip(robot.points, POINT_LINK, strict=True):
        assert robot.links[link] == f"{point.split('_')[0]}_foot"


def test_the_humans_habits_are_the_keys_own_defaults():
    """A scenario made without a file is the human's, as its `model` says."""
    habits = read_toml(folder("models") / "human.toml")["scenario"]
    assert habits.keys() == {"actuation", "backstep"}
    assert Scenario().model == "human"
    for name, value in habits["actuation"].items():
        assert getattr(Actuation(), name) == value
    assert Backstep(**habits["backstep"]) == Backstep()


@pytest.mark.parametrize(("text", "force", "limit"), [("", 30.0, 40.0), ("[actuation]\ntorque_limit = 25", 30.0, 25.0)])
def test_a_scenario_starts_from_its_robots_habits(tmp_path, text, force, limit):
    make(tmp_path)
    path = tmp_path / "s.toml"
    path.write_text(f'model = "toy.xml"\n{text}', encoding="utf-8")
    s = read_scenario(str(path))
    assert (s.actuation.release_force, s.actuation.torque_limit) == (force, limit)
    assert f"release_force = {force}" in to_toml(s), "the effective scenario says it"
    assert read_scenario(str(path), ["actuation.release_force=7"]).actuation.release_force == 7.0
    path.write_text('model = "human"\ncontroller = "normal"', encoding="utf-8")
    human = read_scenario(str(path), [f"model={tmp_path / 'toy.xml'}"])
    assert human.actuation.release_force == 30.0, "the robot asked for on the command line is the robot"


def test_the_step_back_is_the_robots_only_where_a_scenario_asks_for_it(tmp_path):
    make(tmp_path)
    (tmp_path / "toy.toml").write_text(DESCRIPTION + "\n[scenario.backstep]\nk_d2 = 33.0\n", encoding="utf-8")
    path = tmp_path / "s.toml"
    for text, expected in (("", None), ("[backstep]\nmargin = 0.02", Backstep(margin=0.02, k_d2=33.0))):
        path.write_text(f'model = "toy.xml"\n{text}', encoding="utf-8")
        assert read_scenario(str(path)).backstep == expected


BAD = {
    "legs that are no tables": ("leg = 3\n" + DESCRIPTION.partition("[[leg]]")[0], ("leg: expected a list of tables",)),
    "one leg": (DESCRIPTION.replace('[[leg]]\nname = "port"', '[[arm]]\nname = "port"'), ("arm: unknown key", "leg")),
    "a misspelt key": (DESCRIPTION.replace("stops = [\"q_L2\"]", "stop = [\"q_L2\"]"), ("leg[1].stop", "'stops'")),
    "a stop at a hip": (DESCRIPTION.replace('stops = ["q_L2"]', 'stops = ["q_L1"]'), ("leg[1].stops", "'q_L2'")),
    "a part twice": (DESCRIPTION.replace('"LBall", "LCalx"', '"RBall", "LCalx"'), ("points", "'RBall' twice")),
    "two links": (DESCRIPTION.replace('"LTibia", ', ""), ("leg[1].links", "length >= 3")),
    "no torso": (DESCRIPTION.replace('link = "trunk"\n', ""), ("base", "link")),
    "no table of habits": ("scenario = 3\n" + DESCRIPTION.partition("[scenario")[0], ("scenario: expected a table",)),
    "no TOML": ("robot", ("toy.toml: not a TOML file",)),
    "a joint that the model lacks": (DESCRIPTION.replace("q_L3", "q_L4"), ("toy.xml: joint 'q_L4': missing", "q_L3")),
    "a habit no scenario has": (DESCRIPTION + "grip = 3\n", ("toy.toml: actuation.grip: unknown key",)),
    "motors without a limit": (
        DESCRIPTION + "\n[motor]\nvoltage = 24.0\nresistance = 0.3\ntorque_constant = 0.03\nrated_torque = 0.2\n"
        "gears = [21.0, 12.0, 21.0]\ngear_rated = 7.5\n", ("toy.toml: motor", "`gear_peak`")),
    "motors that turn for ever": (
        DESCRIPTION + "\n[motor]\nvoltage = 24.0\nresistance = 0.0\ntorque_constant = 0.03\nrated_torque = 0.2\n"
        "gears = [21.0, 12.0, 21.0]\ngear_rated = 7.5\ngear_peak = 11.3\n", ("toy.toml: motor.resistance", "> 0")),
    "a habit out of range": (DESCRIPTION.replace("= 30.0", "= -30.0"), ("toy.toml: actuation.release_force",)),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_descriptions_are_refused_by_file_and_key(tmp_path, name):
    text, said = BAD[name]
    make(tmp_path)
    (tmp_path / "toy.toml").write_text(text, encoding="utf-8")
    path = tmp_path / "s.toml"
    path.write_text('model = "toy.xml"\ncontroller = "gait.toml"\n', encoding="utf-8")
    with pytest.raises(InputError) as caught:
        Plan(read_scenario(str(path)))
    for words in said:
        assert words in str(caught.value)


def test_a_model_whose_knee_has_no_stop_is_refused(tmp_path):
    model = make(tmp_path)
    text = model.read_text(encoding="utf-8")
    for old, new, said in (
        (
            '<joint name="q_L2" range="-2.4 0"/>',
            '<joint name="q_L2"/>',
            "'q_L2': expected a range that ends at 0",
        ),
        ('<joint name="q_L3" damping="0.01"/>', '<joint name="q_L3" range="-1 1"/>', "joint 'q_L3': expected no range"),
    ):
        model.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(InputError, match=said):
            tree_at(model)
