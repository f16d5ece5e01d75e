"""Laws of robots of any kind: policy networks see what they name, and standing is by what the ground can give."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper, save_model

from biped.base.trust import grant
from biped.control import policy
from biped.control.observation import Observation
from biped.engines.mujoco import simulate
from biped.robot.recognise import robot_of
from biped.scenario.robot import Described
from biped.studies.run import plan_of
from tests.cases import write

LAW = """from biped.control.policy import Policy


class Walker(Policy):
    network = "net.onnx"
    observations = ("q.left_knee", "v.root.z", "contact.left.0", "gravity.z", "com.x", "time")
    offset = 5.0
"""


def test_a_policy_network_of_h1(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    weights = np.random.default_rng(3).normal(size=(6, 19)).astype(np.float32)
    graph = helper.make_graph(
        [helper.make_node("MatMul", ["x", "W"], ["y"])], "linear",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, [1, 6])],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, [1, 19])], [numpy_helper.from_array(weights, "W")],
    )  # fmt: skip
    save_model(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), "net.onnx")
    write("law.py", LAW)
    grant(Path("law.py"))
    t = simulate(plan_of(write("s.toml", 'model = "h1"\nlaw = "law.py:Walker"\nduration = 0.05\n'), ()).run(0))
    names = list(t.robot.q_names)
    left = t.robot.points.index("left.0")
    up = (t.turn.transpose(0, 2, 1) @ [0.0, 0.0, -1.0])[:, 2]
    seen = np.column_stack([t.q[:, names.index("left_knee")], t.v[:, 2], t.contact[:, left], up, t.com[:, 0], t.time])
    wanted = np.clip(5.0 + seen @ weights, -np.array(t.torque_limit), t.torque_limit)
    np.testing.assert_allclose(t.u, wanted, atol=1e-5)


def test_a_wrong_observation_is_answered_with_the_nearest():
    robot = robot_of(Path("models/h1.xml"), Described())
    with pytest.raises(ValueError, match=r"unknown 'q.left_nee'; did you mean 'q.left_knee'\?"):
        policy.places(Observation.names_of(robot), ("q.left_nee",))


def test_standing_asks_the_ground_for_no_more_than_it_gives(tmp_path):
    """On ground of friction 0.3 forces stay within their cones, and the robot is still there."""
    path = write(str(tmp_path / "s.toml"), 'model = "h1"\nlaw = "stand"\nduration = 0.8\nground.friction = 0.3\n'
                 "[[push]]\nat = 0.2\nduration = 0.1\nforce = [20.0, 20.0, 0.0]\n")  # fmt: skip
    t = simulate(plan_of(path, ()).run(0))
    assert t.end == "completed"
    tangential = np.linalg.norm(t.force[:, :, :2], axis=2)
    assert (tangential <= 0.3 * t.force[:, :, 2] + 1e-6).all()
    assert np.abs(t.com[-1, :2] - t.com[0, :2]).max() < 0.1
