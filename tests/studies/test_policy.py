"""Cards from what trainers write, and checks that find what is wrong with one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import onnx
import pytest
import tomli_w

from biped.cli.main import main
from biped.scenario.card import read_card
from biped.studies.policy import check, reproduce, run_of
from biped.studies.policy.tape import Tape, read_tape, record
from biped.studies.policy.trials import faults_of
from tests.cases import write
from tests.control.test_card import CARD, JOINTS, SEEN, here, network

__all__ = ["here"]
FORWARD = (0.3, 0.0, 0.0)
METADATA = {
    "joint_names": "left_hip,left_ankle,right_hip,right_ankle", "joint_stiffness": "30.000,20.000,30.000,20.000",
    "joint_damping": "1.000,0.500,1.000,0.500", "default_joint_pos": "0.100,-0.100,0.100,-0.100",
    "command_names": "twist", "observation_names": "base_ang_vel,projected_gravity,joint_pos,joint_vel,actions,command",
    "observation_terms_scale": "0.25,None,None,0.05,None,None", "observation_terms_history_length": "0,0,3,0,0,0",
    "action_scale": "0.300,0.200,0.300,0.200",
}  # fmt: skip


def mjlab(**change: str) -> None:
    """A network with mjlab's metadata."""
    network(3 + 3 + 12 + 4 + 4 + 3, 4)
    found = onnx.load("net.onnx")
    onnx.helper.set_model_props(found, METADATA | change)
    onnx.save_model(found, "net.onnx")


def written(capsys, *words: str) -> str:
    """What is said of a card that cannot be written."""
    assert main(["policy", "net.onnx", "--model", "r.xml", "--card", "new.toml", *words]) == 2
    return " ".join(capsys.readouterr().err.split())


def test_a_card_from_mjlabs_metadata(capsys):
    mjlab()
    assert "rate: its metadata do not say how often it is asked; expected --rate" in written(capsys)
    assert main(["policy", "net.onnx", "--model", "r.xml", "--card", "new.toml", "--rate", "50", "--json"]) == 1
    checks = {one["name"]: one["passed"] for one in json.loads(capsys.readouterr().out)["checks"]}
    assert checks["names and widths fit the model"]
    assert not checks["walks forward"], "a random network does not walk"
    card = read_card(Path("new.toml"))
    assert card.joints == ("left_hip", "left_ankle", "right_hip", "right_ankle")
    assert card.action.stiffness == (30.0, 20.0, 30.0, 20.0)
    assert [(one.term, one.scale, one.history) for one in card.observation] == [
        ("angular_velocity", 0.25, 1), ("gravity", 1.0, 1), ("joint_position", 1.0, 3), ("joint_velocity", 0.05, 1),
        ("last_action", 1.0, 1), ("command", 1.0, 1)]  # fmt: skip
    assert "is there already" in written(capsys, "--rate", "50")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"joint_stiffness": "30,x,30,20"}, "joint_stiffness: expected numbers with commas between them, got 'x'"),
        ({"observation_names": "base_ang_val,command"}, "observation_terms_scale: expected 2 numbers"),
        (
            {"observation_names": "base_ang_val,projected_gravity,joint_pos,joint_vel,actions,command"},
            "observation 'base_ang_val': no term of a card is called so; did you mean 'base_ang_vel'?",
        ),
    ],
)
def test_metadata_that_are_wrong(capsys, change, words):
    mjlab(**change)
    assert words in written(capsys, "--rate", "50")


def test_metadata_that_are_missing(capsys):
    assert "has no metadata" in written(capsys)


DEPLOY = """
joint_ids_map: [2, 0, 3, 1]
step_dt: 0.02
stiffness: [10.0, 20.0, 30.0, 40.0]
damping: [1.0, 2.0, 3.0, 4.0]
default_joint_pos: [0.1, 0.2, 0.3, 0.4]
commands: {base_velocity: {ranges: {lin_vel_x: [-0.5, 1.0], heading: null}}}
actions:
  JointPositionAction: {clip: null, scale: [0.25, 0.25, 0.25, 0.25], offset: [0.1, 0.2, 0.3, 0.4],
    joint_ids: !!python/object/apply:builtins.slice [null, null, null]}
observations:
  base_ang_vel: {params: {}, clip: null, scale: [0.2, 0.2, 0.2], history_length: 5}
  joint_vel_rel: {params: {}, clip: null, scale: [0.05, 0.05, 0.05, 0.05], history_length: 1}
"""


def test_a_card_from_a_deploy_yaml(capsys):
    """Gains are in the robot's order there, positions in the network's."""
    network(15 + 4, 4)
    write("deploy.yaml", DEPLOY)
    command = ["policy", "net.onnx", "--model", "r.xml", "--deploy", "deploy.yaml", "--card", "new.toml", "--json"]
    assert main(command) == 1
    capsys.readouterr()
    card = read_card(Path("new.toml"))
    assert card.joints == ("right_hip", "left_hip", "right_ankle", "left_ankle")
    assert card.action.stiffness == (30.0, 10.0, 40.0, 20.0)
    assert card.default == (0.1, 0.2, 0.3, 0.4)
    assert (card.rate, card.command) == (50.0, {"forward": (-0.5, 1.0)})
    assert [(one.scale, one.history) for one in card.observation] == [(0.2, 5), (0.05, 1)]
    Path("new.toml").unlink()
    write("deploy.yaml", DEPLOY.replace("[2, 0, 3, 1]", "[2, 0, 3, 9]"))
    assert "joint_ids_map: expected numbers of the 4 driven joints of 'r'" in written(capsys, "--deploy", "deploy.yaml")
    write("deploy.yaml", DEPLOY.replace("step_dt: 0.02", ""))
    assert "expected step_dt, stiffness" in written(capsys, "--deploy", "deploy.yaml")
    write("deploy.yaml", "a: [")
    assert "cannot be read as YAML" in written(capsys, "--deploy", "deploy.yaml")


def taped() -> Tape:
    return record(run_of(Path("card.toml"), read_card(Path("card.toml")), FORWARD))


def test_a_tape_is_reproduced_by_its_card_and_by_no_other():
    tape = taped()
    assert len(tape.time) > 10
    np.savez("tape.npz", **tape._asdict())
    card = Path("card.toml")
    assert [one.name for one in reproduce(card, read_tape(Path("tape.npz"))) if not one.passed] == []
    found = {name: [one.name.partition(" as")[0] for one in reproduce(card, tape, wrong) if not one.passed]
             for name, wrong in faults_of(read_card(card))}  # fmt: skip
    assert [name for name, failed in found.items() if not failed] == []
    assert found["actions late by two calls"] == ["delay"]
    assert found["gravity with the other sign"][0] == "gravity"
    assert found["last action missing"][0] == "last_action"
    assert found["actions with the other sign"] == ["targets"]
    assert found["joints in another order"][0] == "joint_position"
    assert "rate" in found["asked half as often"]


def test_a_frame_and_a_history_the_wrong_way_are_named():
    tape = taped()
    for term, change in (("linear_velocity", {"frame": ""}), ("joint_position", {"history": 3, "delay": 1})):
        seen = [one | change if one["term"] == term else one for one in SEEN]
        write("card.toml", tomli_w.dumps(CARD | {"observation": seen}))
        failed = [one.name for one in reproduce(Path("card.toml"), tape) if not one.passed]
        assert failed[0] == f"{term} as on the tape"


def test_a_tape_that_is_none(capsys):
    write("tape.npz", "no")
    assert main(["policy", "card.toml", "--tape", "tape.npz"]) == 2
    assert "expected a tape: an .npz file of the arrays time, qpos" in " ".join(capsys.readouterr().err.split())
    tape = taped()
    np.savez("tape.npz", **tape._replace(qpos=tape.qpos[:, 1:])._asdict())
    assert main(["policy", "card.toml", "--tape", "tape.npz"]) == 2
    assert "tape: qpos: expected 11 numbers a call" in " ".join(capsys.readouterr().err.split())


def test_what_falls_fails_its_checks():
    checks = check(Path("card.toml"))
    assert not any(one.passed for one in checks if one.name.startswith(("stays up", "walks", "turns")))
    assert read_card(Path("card.toml")).joints == tuple(JOINTS)


def described(name: str, **more) -> str:
    term = {"name": name, "overloads": {"clip": None, "history_length": 0, "scale": None}} | more
    return json.dumps(term)


DESCRIPTORS = f"""
actions:
- {{clip: null, full_path: isaaclab.envs.mdp.actions.joint_actions.JointPositionAction, scale: 0.5,
    joint_names: [left_hip, right_hip, left_ankle, right_ankle], offset: [0.1, 0.1, -0.2, -0.2]}}
articulations:
  robot:
    joint_names: [right_ankle, left_ankle, right_hip, left_hip]
    default_joint_pos: [-0.2, -0.2, 0.1, 0.1]
    default_joint_stiffness: [20.0, 21.0, 30.0, 31.0]
    default_joint_damping: [2.0, 2.1, 3.0, 3.1]
observations:
  policy:
  - {described("base_ang_vel", overloads={"clip": [-9.0, 9.0], "history_length": 5, "scale": 0.2})}
  - {described("joint_pos_rel", joint_names=["left_hip", "right_hip", "left_ankle", "right_ankle"])}
  - {described("joint_vel_rel", joint_names=["left_ankle", "right_ankle"])}
  - {described("generated_commands")}
scene: {{decimation: 4, dt: 0.02, physics_dt: 0.005}}
"""


def test_a_card_from_isaac_labs_descriptors(capsys):
    """Their lists are in the order of the joints that they name, which is not the network's."""
    network(15 + 4 + 2 + 3, 4)
    write("io.yaml", DESCRIPTORS)
    command = ["policy", "net.onnx", "--model", "r.xml", "--deploy", "io.yaml", "--card", "new.toml", "--json"]
    assert main(command) == 1
    capsys.readouterr()
    card = read_card(Path("new.toml"))
    assert card.joints == ("left_hip", "right_hip", "left_ankle", "right_ankle")
    assert (card.default, card.rate) == ((0.1, 0.1, -0.2, -0.2), 50.0)
    assert (card.action.stiffness, card.action.damping) == ((31.0, 30.0, 21.0, 20.0), (3.1, 3.0, 2.1, 2.0))
    assert (card.action.scale, card.action.offset) == (0.5, (0.1, 0.1, -0.2, -0.2))
    first, place, speed, asked = card.observation
    assert (first.term, first.scale, first.history, first.clip) == ("angular_velocity", 0.2, 5, (-9.0, 9.0))
    assert (place.term, place.joints) == ("joint_position", ())
    assert (speed.term, speed.joints) == ("joint_velocity", ("left_ankle", "right_ankle"))
    assert asked.term == "command"
    Path("new.toml").unlink()
    write("io.yaml", DESCRIPTORS.replace("JointPositionAction", "DifferentialInverseKinematicsAction"))
    assert "expected JointPositionAction or JointEffortAction" in written(capsys, "--deploy", "io.yaml")
    write("io.yaml", DESCRIPTORS.replace("scene:", "seen:"))
    assert "expected one action, articulations, observations and scene" in written(capsys, "--deploy", "io.yaml")
