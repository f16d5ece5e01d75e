"""A control law of the user's own: what it is told, what it senses, what becomes of what it returns."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from biped.base.trust import trusting
from biped.cli.main import main
from biped.control.user import UserLaw, load_law
from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.robot.model import tree_at
from biped.scenario.reading import read_scenario
from tests.cases import SHORT, command, write
from tests.ticks import OFFSET, S, dynamics

PAGE = Path(__file__).parents[2] / "docs" / "python.md"

SPY = """from __future__ import annotations
from dataclasses import dataclass
import copy
import numpy as np
import helper

SEEN = []

@dataclass
class Spy:
    setup: object

    def torques(self, sensed):
        SEEN.append(copy.deepcopy(sensed))
        return helper.torques(sensed)
"""
HELPER = """import numpy as np

def torques(sensed):
    return np.array([1e4, -1e4, 5.0, 0.0, -sensed.v[7], 40.0 * (1.5708 - sensed.angle[4])])
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_the_example_of_the_page(capsys):
    code, name = re.search(r"```python\n(# (\w+\.py)\n.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL).groups()
    write(name, code)
    write("s.toml", SHORT)
    _, result = command(capsys, "run", "s.toml", "--set", f"law={name}:Stand", "--out", "x")
    t = Trajectory.load(Path("x/trajectory.npz"))
    wanted = 300.0 * (t.q[0, 3:] - t.q[:, 3:]) - 30.0 * t.v[:, 3:]
    np.testing.assert_allclose(t.u, np.clip(wanted, -200.0, 200.0), atol=1e-9)
    assert not result["runs"][0]["fell"]
    # The effective scenario names the law too.
    _, again = command(capsys, "run", "x/scenario.toml", "--trust")
    assert again["runs"] == result["runs"]


@pytest.fixture
def spied():
    """A run through a law that keeps what it senses: (trajectory, what was sensed, scenario)."""
    Path("laws").mkdir()
    write("laws/spy.py", SPY)
    write("laws/helper.py", HELPER)
    write("laws/s.toml", "law = 'spy.py:Spy'\nground.slope = 3.0\n" + SHORT)
    with trusting(everything=True):
        s = read_scenario("laws/s.toml")
        t = simulate(Plan(s).run(0))
        yield t, sys.modules["biped_law_spy"].SEEN[-len(t) :], s


def test_what_a_law_senses(spied):
    t, seen, _ = spied
    assert len(seen) == len(t) > 100
    for k in range(0, len(t), 25):
        sensed = seen[k]
        assert sensed.time == t.time[k]
        np.testing.assert_array_equal(sensed.q, t.q[k])
        np.testing.assert_array_equal(sensed.v, t.v[k])
        np.testing.assert_array_equal(sensed.height, t.height[k])
        np.testing.assert_array_equal(sensed.contact, t.believed[k])
        np.testing.assert_array_equal(sensed.state, t.phase[k])
        d = dynamics(t.q[k], t.v[k], slope=3.0)
        np.testing.assert_allclose(sensed.M, d.M, atol=1e-10)
        np.testing.assert_allclose(sensed.h, d.h, atol=1e-8)
        # Absolute angles as in the thesis, measured from gravity: the slope frame's plus the slope.
        absolute = np.linalg.solve(S, t.q[k] - OFFSET)
        np.testing.assert_allclose(sensed.angle, absolute[2:] + np.radians(3.0), atol=1e-12)
        np.testing.assert_allclose(sensed.rate, np.linalg.solve(S, t.v[k])[2:], atol=1e-12)


def test_what_a_law_returns_is_clipped_and_applied(spied):
    t, seen, _ = spied
    np.testing.assert_array_equal(t.u[:, :4], np.broadcast_to([200.0, -200.0, 5.0, 0.0], (len(t), 4)))
    np.testing.assert_allclose(t.u[:, 4], np.clip(-t.v[:, 7], -200.0, 200.0))
    np.testing.assert_allclose(t.u[:, 5], [40.0 * (1.5708 - sensed.angle[4]) for sensed in seen])


def test_what_a_law_is_told(spied):
    _, _, s = spied
    run = Plan(s).run(0)
    law = UserLaw(run, tree_at(run.model), np.zeros(9), np.zeros(9), np.zeros((1, 60)))
    setup = law._law.setup
    assert setup.scenario.duration == 0.5
    assert setup.gains.k_d1 == 400.0
    assert setup.tree.mass.sum() == pytest.approx(75.0)
    assert setup.model.nv == 9
    assert setup.tick == 0.001
    np.testing.assert_array_equal(setup.torque_limit, 200.0)


def test_a_law_is_loaded_once_per_run_and_apart_from_other_modules(spied):
    """Two laws in files of the same name do not see each other's state."""
    Path("other").mkdir()
    write("other/spy.py", "class Spy:\n    pass\n")
    first = load_law(f"{Path('laws/spy.py').resolve()}:Spy")
    second = load_law(f"{Path('other/spy.py').resolve()}:Spy")
    assert first is not second
    assert hasattr(first, "torques")


def test_helpers_of_two_laws_are_apart(tmp_path):
    """Files of one name beside two laws: each law has its own."""
    for name in "ab":
        Path(name).mkdir()
        write(f"{name}/law.py", "import aid\nclass Law:\n    value = aid.value\n")
        write(f"{name}/aid.py", f"value = '{name}'\n")
    with trusting(everything=True):
        assert [load_law(f"{tmp_path}/{name}/law.py:Law").value for name in "aba"] == ["a", "b", "a"]
    assert "aid" not in sys.modules


def test_processes_do_not_change_a_laws_numbers():
    write("l.py", "import numpy as np\n\nclass Mine:\n    def __init__(self, setup):\n        pass\n\n"
          "    def torques(self, sensed):\n        return -50.0 * sensed.q[3:] - 5.0 * sensed.v[3:]\n")  # fmt: skip
    write("s.toml", "law = 'l.py:Mine'\nduration = 0.2\nrandomise.runs = 4\nstart.jitter = 0.01\n")
    for jobs in "12":
        main(["run", "s.toml", "--trust", "--jobs", jobs, "--out", jobs])
    assert Path("1/result.json").read_bytes() == Path("2/result.json").read_bytes()
