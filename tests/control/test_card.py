"""Policies from their cards: what they see and do, against a plain loop of MuJoCo and onnxruntime."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import onnxruntime
import pytest
import tomli_w
from onnx import TensorProto, helper, numpy_helper, save_model

import biped
from biped.cli.main import main
from biped.engines.mujoco import loop_of, simulate
from biped.ensemble.plan import Plan
from biped.robot.spec import read
from biped.scenario.reading import read_scenario
from biped.scenario.robot import Described
from tests.cases import write
from tests.robot.test_recognise import model

SERVOS = "".join(f'<position name="{s}_{j}_servo" joint="{s}_{j}" kp="60" kv="2" forcerange="-40 40" ctrlrange="-1 1"/>'
                 for s in ("left", "right") for j in ("hip", "ankle"))  # fmt: skip
JOINTS = ["right_hip", "right_ankle", "left_hip", "left_ankle"]
FLOOR = '<geom name="floor" type="plane" size="1 1 1" friction="0.7"/><site name="eye" pos="0 0 0"/>'
SEEN = [
    {"term": "linear_velocity", "frame": "imu"}, {"term": "angular_velocity", "frame": "imu", "scale": 0.25},
    {"term": "gravity"}, {"term": "command", "scale": [2.0, 2.0, 0.25]}, {"term": "joint_position", "history": 3},
    {"term": "joint_velocity", "scale": 0.05, "clip": [-5.0, 5.0]}, {"term": "last_action"}, {"term": "clock_cos_sin"},
]  # fmt: skip
SIZE = 3 + 3 + 3 + 3 + 12 + 4 + 4 + 4
CARD: dict[str, Any] = {
    "network": "net.onnx", "rate": 50.0, "start": 0.02, "joints": JOINTS, "default": [0.1, -0.1, 0.1, -0.1],
    "action": {"scale": 0.3}, "observation": SEEN, "clock": {"frequency": 1.5, "offsets": [0.0, 3.0]},
    "scenario": {"model": "r.xml", "duration": 0.5},
}  # fmt: skip


def network(inputs: int, outputs: int, seed: int = 1) -> None:
    """A network tanh(W x) with random weights."""
    weights = np.random.default_rng(seed).normal(size=(inputs, outputs)) / np.sqrt(inputs)
    graph = helper.make_graph(
        [helper.make_node("MatMul", ["x", "W"], ["z"]), helper.make_node("Tanh", ["z"], ["y"])], "net",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, [1, inputs])],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, [1, outputs])],
        [numpy_helper.from_array(weights.astype(np.float32), "W")],
    )  # fmt: skip
    save_model(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), "net.onnx")


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    option = '<option timestep="0.004" integrator="implicitfast" ls_iterations="9"/>'
    text = model(actuators=SERVOS, world=FLOOR).replace("<mujoco>", "<mujoco>" + option)
    write("r.xml", text.replace("<freejoint/>", '<freejoint/><site name="imu" pos="0.1 0 0.2" euler="0 20 0"/>', 1))
    network(SIZE, 4)
    write("card.toml", tomli_w.dumps(CARD))
    write("s.toml", 'law = "card.toml"\ncommand = { forward = 0.3, piece = [{ at = 0.1, over = 0.2, yaw = 0.5 }] }\n')


def plain(q: np.ndarray, steps: int, gains: tuple[float, float] | None = None) -> np.ndarray:
    """(steps, nq) the loop as a trainer would write it; with gains, servos computed by the loop itself."""
    m = read(Path("r.xml"), Described()).compile()
    d = mujoco.MjData(m)
    d.qpos[:] = q
    order = [m.actuator(f"{joint}_servo").id for joint in JOINTS]
    places = [m.joint(joint).qposadr[0] for joint in JOINTS]
    columns = [m.joint(joint).dofadr[0] for joint in JOINTS]
    default, target = np.array(CARD["default"]), np.array(CARD["default"])
    if gains is not None:
        for i in range(m.nu):
            m.actuator_gainprm[i, 0], m.actuator_biasprm[i, :3] = 1.0, 0.0
            m.actuator_biastype[i], m.actuator_ctrllimited[i] = mujoco.mjtBias.mjBIAS_NONE, 0
    session = onnxruntime.InferenceSession("net.onnx")
    last, phase, history, out = np.zeros(4, np.float32), np.array([0.0, 3.0]), [], []
    for k in range(steps):
        out.append(d.qpos.copy())
        mujoco.mj_step1(m, d)
        if k >= 5 and (k - 5) % 5 == 0:
            t = k * 0.004
            share = min(1.0, max(0.0, t - 0.1) / 0.2)
            command = np.array([0.3, 0.0, 0.0]) * (1 - share) + np.array([0.0, 0.0, 0.5]) * share
            R = d.site("imu").xmat.reshape(3, 3)
            velocity = np.empty(6)
            mujoco.mj_objectVelocity(m, d, mujoco.mjtObj.mjOBJ_SITE, m.site("imu").id, velocity, 0)
            down = d.body("trunk").xmat.reshape(3, 3).T @ [0.0, 0.0, -1.0]
            history = [*(history or [d.qpos[places] - default] * 3)[1:], d.qpos[places] - default]
            shown = np.concatenate([R.T @ velocity[3:], 0.25 * R.T @ velocity[:3], down, command * [2.0, 2.0, 0.25],
                                    *history, 0.05 * np.clip(d.qvel[columns], -5.0, 5.0), last, np.cos(phase),
                                    np.sin(phase)])  # fmt: skip
            last = session.run(None, {"x": shown[None].astype(np.float32)})[0][0]
            target = default + 0.3 * last
            phase = np.fmod(phase + 2.0 * np.pi * 1.5 * 0.02 + np.pi, 2.0 * np.pi) - np.pi
        if gains is None:
            d.ctrl[order] = target
        else:
            d.ctrl[order] = np.clip(gains[0] * (target - d.qpos[places]) - gains[1] * d.qvel[columns], -8.0, 8.0)
        mujoco.mj_step2(m, d)
    return np.array(out)


def test_a_card_is_the_trainers_loop():
    t = biped.run("s.toml").trajectory
    assert len(t.q) > 60
    assert np.abs(t.u).max() > 1.0
    np.testing.assert_allclose(t.q, plain(t.q[0], len(t.q)), rtol=0.0, atol=1e-6)


def test_servos_of_the_law_itself():
    action = {"scale": 0.3, "stiffness": [30.0] * 4, "damping": 0.5, "effort": 8.0, "servo": "law"}
    write("card.toml", tomli_w.dumps(CARD | {"action": action}))
    t = biped.run("s.toml").trajectory
    assert 5.0 < np.abs(t.u).max() <= 8.0 + 1e-9
    np.testing.assert_allclose(t.q, plain(t.q[0], len(t.q), (30.0, 0.5)), rtol=0.0, atol=1e-6)


def test_servos_that_a_card_brings_are_mujocos():
    action = {"scale": 0.3, "stiffness": 60.0, "damping": [2.0] * 4, "effort": 40.0}
    write("card.toml", tomli_w.dumps(CARD | {"action": action}))
    ours = biped.run("s.toml").trajectory
    np.testing.assert_allclose(ours.q, plain(ours.q[0], len(ours.q)), rtol=0.0, atol=1e-6)


OWN_SERVOS = {"scale": 0.3, "stiffness": 30.0, "damping": 0.5, "effort": 8.0, "servo": "law"}
HELD = {
    "targets": ({}, ()),
    "late by five steps, with a lag": ({"action": {"scale": 0.3, "delay": 0.02}}, ("actuation.lag=0.01",)),
    "servos of its own": ({"action": OWN_SERVOS | {"delay": 0.012}}, ("actuation.lag=0.02",)),
    "servos of its own, weak": ({"action": OWN_SERVOS}, ("actuation.torque_limit=5.0",)),
    "torques": ({"action": {"kind": "torque", "scale": 5.0}}, ()),
    "logged at the calls": ({"start": 0.0}, ("simulation.control_rate=50.0",)),
    "histories by call": ({"stacked": "call", "observation": [{"term": "joint_position", "history": 4, "delay": 2},
                           {"term": "joint_velocity", "history": 4}, {"term": "last_action", "history": 4}]}, ()),
    "late actuators": ({}, ("actuation.delay=0.012", "actuation.delay_jitter=0.012")),
    "a push": ({}, ("push=[{at=0.1,duration=0.052,force=[40.0,0.0,0.0]}]",)),
    "a push of what begins in the air": ({"scenario": CARD["scenario"] | {"start": {"settle": False}}}, (
        "start.jitter=0.01", "push=[{at=0.2,duration=0.052,force=[40.0,0.0,0.0]}]")),
    "a slope": ({}, ("ground.slope=5.0",)),
    "a margin": ({"scenario": CARD["scenario"] | {"model": "margin.xml"}}, ()),
}  # fmt: skip


def planned(*changes: str):
    return Plan(read_scenario("s.toml", ["window.start=0.0", "window.end=0.4", "duration=0.4", *changes])).run(0)


@pytest.mark.parametrize("case", HELD)
def test_between_two_calls_the_compiled_loop_has_the_bits_of_the_one_in_python(case):
    card, changes = HELD[case]
    write("card.toml", tomli_w.dumps(CARD | card))
    write("margin.xml", Path("r.xml").read_text().replace('name="floor"', 'name="floor" margin="0.01"'))
    if case == "histories by call":
        network(48, 4)
    run = planned(*changes)
    fast, slow = simulate(run), simulate(run, watch=lambda model, data, forces: None)
    assert loop_of(run) == "compiled"
    assert (fast.end, fast.cause, len(fast)) == (slow.end, slow.cause, len(slow))
    assert np.abs(fast.u).max() > 0.1
    assert fast.log.tobytes() == slow.log.tobytes()
    assert fast.outside.tobytes() == slow.outside.tobytes()


def test_a_network_that_fails_later_ends_both_loops_alike():
    weights = numpy_helper.from_array(np.full((1, 4), 4.0, np.float32), "W")
    # Of the time: 4 t / (0.1 - t) is infinite at one call.
    nodes = [helper.make_node("Sub", ["c", "x"], ["d"]), helper.make_node("Div", ["x", "d"], ["e"]),
             helper.make_node("MatMul", ["e", "W"], ["y"])]  # fmt: skip
    infos = [helper.make_tensor_value_info(n, TensorProto.FLOAT, [1, k]) for n, k in (("x", 1), ("y", 4))]
    constant = numpy_helper.from_array(np.array([[0.1]], np.float32), "c")
    graph = helper.make_graph(nodes, "net", infos[:1], infos[1:], [weights, constant])
    save_model(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), "net.onnx")
    action = {"scale": 0.001, "kind": "torque"}
    write("card.toml", tomli_w.dumps(CARD | {"observation": [{"term": "time"}], "action": action, "start": 0.0}))
    run = planned()
    fast, slow = simulate(run), simulate(run, watch=lambda model, data, forces: None)
    assert (fast.end, fast.cause, len(fast)) == (slow.end, slow.cause, len(slow))
    assert fast.end == "raised"
    assert fast.log.tobytes() == slow.log.tobytes()


def test_what_was_asked_for_is_logged_and_compared():
    result = biped.run("s.toml", **{"window.start": 0.1, "window.end": 0.3})
    signals = result.trajectory.signals
    np.testing.assert_allclose(signals["command_yaw"][[0, 25, 50, 74]], [0.0, 0.0, 0.25, 0.49], atol=1e-12)
    assert result.summary["commanded"] == pytest.approx(0.15, abs=0.01)
    assert result.summary["command_error"] > 0.0
    assert result.summary["walked"] == 0


BAD = {
    "rate": ({"rate": -1.0}, "card.toml: rate: expected"),
    "not a part of the steps": ({"rate": 60.0}, "rate: expected a whole part of 250 Hz"),
    "start": ({"start": 0.001}, "start: expected a whole number of ticks"),
    "an unknown key": ({"stifness": 3.0}, "stifness: unknown key"),
    "a key of the action": ({"action": {"stifness": 3.0}}, "action.stifness: unknown key; did you mean 'stiffness'?"),
    "no joints": ({"joints": []}, "joints: expected the names"),
    "a joint twice": ({"joints": [*JOINTS[:3], "left_hip"]}, "joints: expected each once, got 'left_hip' twice"),
    "no such joint": (
        {"joints": [*JOINTS[:3], "left_ankel"]},
        "'left_ankel' is no driven joint of model 'r'; did you mean 'left_ankle'?",
    ),
    "one joint too few": ({"joints": JOINTS[:3], "default": 0.0}, "the network takes"),
    "defaults": ({"default": [0.0] * 3}, "default: expected one number, or one for each of the 4 joints, got 3"),
    "scales": ({"action": {"scale": [1.0] * 5}}, "action.scale: expected one number, or one for each of the 4"),
    "damping alone": ({"action": {"damping": 1.0}}, "action.stiffness: expected one beside action.damping"),
    "negative": ({"action": {"stiffness": -1.0, "damping": 1.0}}, "action.stiffness: expected no negative number"),
    "torques with servos": ({"action": {"kind": "torque", "stiffness": 1.0, "damping": 1.0}}, "expected none: torques"),
    "a kind": ({"action": {"kind": "positions"}}, "action.kind: expected one of position, torque"),
    "servos of nobody": ({"action": {"servo": "law"}}, "action.servo: expected 'actuator'"),
    "bounds the wrong way": ({"action": {"clip": [1.0, -1.0]}}, "action.clip: expected [lower, upper]"),
    "a late action": ({"action": {"delay": 0.001}}, "action.delay: expected a whole number of ticks"),
    "no observation": ({"observation": []}, "observation: "),
    "a term": ({"observation": [{"term": "base_lin_vel"}]}, "observation[0].term: unknown term 'base_lin_vel'"),
    "a key of a term": (
        {"observation": [{"term": "command", "scal": 1.0}]},
        "observation[0].scal: unknown key; did you",
    ),
    "a term's scale": (
        {"observation": [{"term": "command", "scale": [1.0, 2.0]}]},
        "observation[0].scale: expected one",
    ),
    "a term without a name": ({"observation": [{"scale": 1.0}]}, "missing key"),
    "no clock": ({"observation": [{"term": "clock_cos_sin"}], "clock": None}, "clock: expected a table"),
    "a frame of a scalar": (
        {"observation": [{"term": "command", "frame": "imu"}]},
        "observation[0].frame: expected none",
    ),
    "joints of a vector": (
        {"observation": [{"term": "gravity", "joints": ["left_hip"]}]},
        "observation[0].joints: expected",
    ),
    "a stranger's joint": (
        {"observation": [{"term": "joint_position", "joints": ["left_hop"]}]},
        "did you mean 'left_hip'",
    ),
    "history": ({"observation": [{"term": "gravity", "history": 0}]}, "observation[0].history: expected"),
    "widths": ({"observation": SEEN[:-1]}, "the network takes 36 numbers, the card shows 32 (linear_velocity 3,"),
    "no network": ({"network": "nett.onnx"}, "network: no file 'nett.onnx' beside the card; did you mean 'net.onnx'?"),
    "no network at all": ({"network": None}, "missing key `network`"),
    "another file": ({"network": "r.xml"}, "r.xml: not an ONNX network"),
    "a frequency": ({"clock": {"frequency": 0.0}}, "clock.frequency: expected"),
    "lengths": ({"stacked": "call"}, "stacked: expected 'term'"),
    "stacked": ({"stacked": "calls"}, "stacked: expected one of term, call, got 'calls'; did you mean 'call'?"),
    "a component": (
        {"command": {"froward": [0.0, 1.0]}},
        "command.froward: unknown component; did you mean 'forward'?",
    ),
    "ranges": ({"command": {"forward": [1.0, 0.0]}}, "command.forward: expected [lower, upper]"),
    "a scenario's key": ({"scenario": {"modell": "r.xml"}}, "scenario.modell: unknown key; did you mean 'model'?"),
    "infinite": ({"rate": float("inf")}, "rate: expected a finite number"),
    "words for numbers": ({"default": "zero"}, "default: expected"),
    "a rate in words": ({"rate": "fast"}, "rate: expected a number, got a string"),
    "a term as a word": ({"observation": ["command"]}, "observation: expected a list of tables"),
    "joints as a word": ({"joints": "left_hip"}, "joints: expected a list, got a string"),
    "a servo's place": ({"action": {"servo": "actuators"}}, "action.servo: expected one of actuator, law"),
    "no effort": (
        {"action": {"stiffness": 1.0, "damping": 1.0, "effort": 0.0}},
        "action.effort: expected more than 0 N m",
    ),
    "a delay into the future": ({"observation": [{"term": "gravity", "delay": -1}]}, "observation[0].delay: expected"),
    "half a bound": ({"observation": [{"term": "gravity", "clip": [1.0]}]}, "observation[0].clip: expected a list of"),
    "a key of the clock": ({"clock": {"frequency": 1.0, "offset": [0.0]}}, "clock.offset: unknown key; did you mean"),
    "no number": ({"action": {"scale": float("nan")}}, "action.scale: expected a finite number, got nan"),
    "another width": (
        {"observation": [{"term": "gravity", "offset": [1.0, 2.0]}]},
        "observation[0].offset: expected one number, or one for each of the 3",
    ),
    "no such model": ({"scenario": {"model": "rr.xml"}}, "model: no model 'rr.xml'; expected the path of a file"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_card_is_refused_by_file_and_key(case, capsys):
    change, words = BAD[case]
    write("card.toml", tomli_w.dumps({key: value for key, value in (CARD | change).items() if value is not None}))
    assert main(["run", "s.toml", "--out", "x"]) == 2
    complaint = " ".join(capsys.readouterr().err.split())
    assert words in complaint
    assert "card.toml" in complaint or case == "another file"
    assert "Traceback" not in complaint


def test_a_frame_that_the_model_lacks(capsys):
    write("card.toml", tomli_w.dumps(CARD | {"observation": [{"term": "gravity", "frame": "imo"}, *SEEN[1:]]}))
    assert main(["run", "s.toml", "--out", "x"]) == 2
    assert "neither a site nor a body 'imo'; did you mean 'imu'?" in " ".join(capsys.readouterr().err.split())
