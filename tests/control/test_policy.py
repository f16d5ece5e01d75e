"""Policy networks: what they are shown, what becomes of their numbers, and what is said of those that do not fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper, save_model

from biped.base.files import folder
from biped.base.trust import trusting
from biped.cli.main import main
from biped.control.planar.user import PlanarObservation
from biped.measure.stored import load
from biped.measure.trajectory import Trajectory
from biped.robot.load import load_robot
from biped.scenario.laws import digest
from tests.cases import SHORT, command, write
from tests.ticks import HUMAN

LAW = """from biped.control.policy import Policy

class Walker(Policy):
    network = "net.onnx"
    observations = {seen}
    {more}
"""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def linear(weights: np.ndarray, file: str = "net.onnx") -> None:
    """A network that multiplies by `weights` (n, 6)."""
    graph = helper.make_graph(
        [helper.make_node("MatMul", ["x", "W"], ["y"])], "linear",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, [1, weights.shape[0]])],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, [1, weights.shape[1]])],
        [numpy_helper.from_array(weights.astype(np.float32), "W")],
    )  # fmt: skip
    save_model(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), file)


def walked(seen: tuple[str, ...], more: str = "pass") -> Trajectory:
    write("law.py", LAW.format(seen=repr(seen), more=more))
    write("s.toml", SHORT)
    assert main(["run", "s.toml", "--set", "law=law.py:Walker", "--out", "x"]) in (0, 1)
    return load(Path("x/trajectory.npz"))


def test_torques_are_of_what_is_named():
    seen = ("q.right_hip", "v.left_knee", "height.left_heel", "contact.right_toe", "state.left.1", "time", "q.root_z")
    weights = np.random.default_rng(2).normal(size=(7, 6))
    linear(weights)
    t = walked(seen, "scale = 10.0\n    offset = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)")
    shown = np.column_stack(
        [t.q[:, 3], t.v[:, 7], t.height[:, 3], t.believed[:, 0], t.phase[:, 1] == 1, t.time, t.q[:, 1]]
    )
    np.testing.assert_allclose(t.u, np.clip(10.0 * shown @ weights + np.arange(1, 7), -200, 200), atol=2e-3)
    assert np.abs(t.u).std(axis=0).min() > 0.1


def test_positions_are_held_by_springs_and_dampers():
    linear(np.ones((1, 6)))
    more = 'action = "position"\n    scale = 0.1\n    stiffness = 200.0\n    damping = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)'
    t = walked(("angle.left_shank",), more)
    angle = t.q[:, 2] + t.q[:, 6] + t.q[:, 7] + 0.5 * np.pi
    wanted = 200.0 * (0.1 * angle[:, None] - t.q[:, 3:]) - np.arange(1, 7) * t.v[:, 3:]
    np.testing.assert_allclose(t.u, np.clip(wanted, -200.0, 200.0), atol=1e-3)


def test_in_between_an_action_holds():
    linear(np.ones((1, 6)))
    t = walked(("time",), "rate = 100.0")
    np.testing.assert_allclose(t.u[:, 0], np.floor(t.time * 100.0 + 1e-6) / 100.0, atol=1e-6)


def test_names_and_numbers_are_as_many():
    robot = load_robot(HUMAN, None)
    names = PlanarObservation.names_of(robot)
    assert len(names) == len(set(names)) == 9 + 9 + 7 + 7 + 4 + 4 + 6 + 9 + 8 + 1


@pytest.mark.parametrize(
    ("seen", "more", "words"),
    [
        (("q.right_hop",), "pass", "did you mean 'q.right_hip'"),
        (("time",), "action = 'speed'", "expected 'torque' or 'position'"),
        (("time",), "rate = 300.0", "whole part of 1000 Hz"),
        (("time", "q.root_z"), "pass", "expected one input (1, 2)"),
        (("time",), "network = 'other.onnx'", "no file other.onnx"),
        (("time",), "network = 'law.py'", "not an ONNX network"),
        (("time",), "scale = (1.0, 2.0)", "raised ValueError"),
    ],
)
def test_what_does_not_fit_is_said(capsys, seen, more, words):
    linear(np.ones((1, 6)))
    write("law.py", LAW.format(seen=repr(seen), more=more))
    write("s.toml", SHORT)
    assert main(["run", "s.toml", "--set", "law=law.py:Walker"]) == 2
    assert words in capsys.readouterr().err
    assert not Path("runs").exists()


def test_without_onnxruntime_the_extra_is_named(capsys, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "onnxruntime", None)
    linear(np.ones((1, 6)))
    write("law.py", LAW.format(seen="('time',)", more="pass"))
    write("s.toml", SHORT)
    assert main(["run", "s.toml", "--set", "law=law.py:Walker"]) == 2
    assert "pip install onnxruntime" in capsys.readouterr().err


def test_a_network_is_part_of_the_law(capsys):
    linear(np.zeros((1, 6)))
    walked(("time",))
    law = f"{Path('law.py').resolve()}:Walker"
    before = digest(law)
    linear(np.ones((1, 6)))
    assert digest(law) != before
    with trusting(everything=True):
        assert main(["run", "x/scenario.toml", "--trust", "--out", "y"]) == 2
    assert "has changed since these results were made" in capsys.readouterr().err


SHIPPED = folder("controllers") / "policy" / "walker.py"


def test_the_shipped_network_walks(capsys):
    write(
        "s.toml",
        'extends = "calm/own"\nduration = 4.0\nactuation.contacts = "released"\n[window]\nstart = 1.0\nend = 4.0\n',
    )
    code, result = command(capsys, "run", "s.toml", "--set", f"law={SHIPPED}:Walker")
    assert code == 0
    assert result["summary"]["walked"] == 1
