"""A control law of the user's own: what it is told, what it senses, what becomes of what it returns."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

from biped.base.trust import trusting
from biped.cli.main import main
from biped.control.law import load_law
from biped.control.planar import start_law
from biped.control.planar.user import UserLaw
from biped.engines.planar.mujoco import simulate
from biped.ensemble import failures
from biped.ensemble.plan import Plan
from biped.measure.stored import load
from biped.robot.columns import PHASE, WIDTH
from biped.robot.planar.model import tree_at
from biped.robot.run import factory_of
from biped.scenario.reading import read_scenario
from tests.cases import SHORT, command, write
from tests.show.recordings import read
from tests.ticks import OFFSET, S, dynamics, jdot_v, rows_of

PAGE = Path(__file__).parents[3] / "docs" / "python.md"

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
    t = load(Path("x/trajectory.npz"))
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
    setup = law._law.law.setup
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


@pytest.mark.parametrize("controller", ["normal", "robust"])
def test_the_law_to_start_from_is_the_compiled_one(controller):
    """Tick for tick on the compiled law's own walk; 'robust' has single tangential rows and releases more often."""
    changes = [
        f"controller={controller}",
        "duration=1.5",
        "window.start=0.5",
        "window.end=1.5",
        "reading=clipped",
    ]  # of which the law to start from is a copy
    s = read_scenario("level_normal", changes)
    t = simulate(Plan(s).run(0))
    run = Plan(s, law=factory_of(start_law.Law)).run(0)
    q, v, log = np.zeros(9), np.zeros(9), np.zeros((len(t), WIDTH))
    law = UserLaw(run, tree_at(run.model), q, v, log)
    saturated = 0
    for k in range(len(t)):
        q[:], v[:] = t.q[k], t.v[k]
        assert law.tick(k, t.time[k]) == 0
        np.testing.assert_allclose(law.u, t.u[k], atol=1e-8)
        np.testing.assert_allclose(law.Q_d, t.Q_d[k], atol=1e-9)
        saturated += np.abs(law.u).max() == 200.0
    np.testing.assert_array_equal(log[:, PHASE : PHASE + 2], t.phase)
    assert 0 < saturated < len(t)  # both within the limits and at them
    assert law.signals.names == ("contacts", "wanted_torque")
    np.testing.assert_allclose(law.signals.values[:, 0], t.active[:, :4].sum(axis=1))
    assert (t.active[:, :4] < (t.height < 0.001)).any()  # points were released


def test_what_else_a_law_senses(spied):
    t, seen, s = spied
    for k in range(0, len(t), 25):
        sensed = seen[k]
        d = dynamics(t.q[k], t.v[k], slope=3.0)
        np.testing.assert_allclose(sensed.J[:8], d.J, atol=1e-10)
        np.testing.assert_array_equal(sensed.J[8:], np.eye(9)[[4, 7]])
        np.testing.assert_allclose(sensed.b_v[:8], -jdot_v(t.q[k], t.v[k]), atol=2e-5)
        np.testing.assert_array_equal(sensed.touching[:4], t.height[k] < s.sensing.contact_height)
        np.testing.assert_array_equal(sensed.touching[4:], -t.q[k, [4, 7]] < s.sensing.knee_angle)
        A, b = rows_of(sensed.touching, d, -sensed.b_v[:8])
        np.testing.assert_allclose(sensed.A, A, atol=1e-10)
        np.testing.assert_allclose(sensed.b_v[sensed.rows], b, atol=1e-12)
    np.testing.assert_array_equal([sensed.Q_d for sensed in seen], t.Q_d)
    assert {len(sensed.rows) for sensed in seen} - {0, 1}


def test_a_flat_foot_may_have_one_tangential_row(spied):
    sensed = spied[1][0]
    sensed.touching = np.array([1, 1, 1, 0, 0, 1])
    assert sensed.rows == [0, 1, 2, 3, 4, 5, 9]
    sensed.single_tangential = True
    assert sensed.rows == [0, 2, 3, 4, 5, 9]


LATE = """import numpy as np

class Late:
    def __init__(self, setup):
        self.calls = 0
        self.signals = {"calls": 0.0, "half": float("nan")}

    def torques(self, sensed):
        self.calls += 1
        self.signals["calls"] = self.calls
        if sensed.time > 0.2:
            self.signals["half"] = 0.5
        if self.calls == 302:
            raise ZeroDivisionError("no more")
        return -50.0 * sensed.q[3:] - 5.0 * sensed.v[3:]
"""


def test_a_law_that_raises_late_keeps_all_up_to_there(capsys):
    write("late.py", LATE)
    write("s.toml", SHORT)
    assert main(["run", "s.toml", "--set", "law=late.py:Late", "--record", "--out", "x"]) == 1
    said = capsys.readouterr().out
    assert (
        "law: late.py:Late raised ZeroDivisionError at 0.301 s: ZeroDivisionError: no more (late.py, line 14)" in said
    )
    assert "x/traceback.txt" in said
    assert 'raise ZeroDivisionError("no more")' in Path("x/traceback.txt").read_text()
    t = load(Path("x/trajectory.npz"))
    assert len(t) == 301
    assert (t.end, t.time[-1]) == ("raised", 0.3)
    assert t.force[-1].any()  # the last row is whole, its ground forces too
    assert Path("x/recording.rrd").stat().st_size > 10_000
    (run,) = json.loads(Path("x/result.json").read_text())["runs"]
    assert (run["end"], run["fell"], run["walked"]) == ("raised", False, False)
    # and it is the run that it would have been
    write("fine.py", LATE.replace("302", "10**9"))
    main(["run", "s.toml", "--set", "law=fine.py:Late", "--out", "y"])
    np.testing.assert_array_equal(load(Path("y/trajectory.npz")).log[:301], t.log)


def test_a_law_that_raises_in_a_campaign_leaves_the_others(capsys):
    begins = "self.calls = 0\n"
    unlucky = f"{begins}        self.unlucky = setup.scenario.ground.friction > 1.5\n"
    write("late.py", LATE.replace("== 302", "== (100 if self.unlucky else 10**9)").replace(begins, unlucky))
    write("s.toml", SHORT + '[randomise]\nruns = 4\n[randomise.draw]\n"ground.friction" = { grid = [1.0, 2.0] }\n')
    code, result = command(capsys, "run", "s.toml", "--set", "law=late.py:Late", "--out", "x", "--jobs", "2")
    assert code == 1
    assert [run["end"] == "raised" for run in result["runs"]] == [False, True, False, True]
    kept = Path("x/failures/run-00001.txt").read_text()
    assert "raised ZeroDivisionError at 0.099 s" in kept
    assert "Traceback" in kept
    assert "--only 1 --trust" in kept
    assert len(failures.load_packed(Path("x/failures/run-00001.xz"))) == 99


def test_a_laws_own_signals_are_in_trajectory_result_and_table(capsys):
    write("fine.py", LATE.replace("302", "10**9"))
    write("s.toml", SHORT + "[window]\nstart = 0.3\nend = 0.4\n[randomise]\nruns = 2\n")
    code, result = command(capsys, "run", "s.toml", "--set", "law=fine.py:Late", "--out", "x")
    assert code == 0
    for run in result["runs"]:  # the second's count begins anew
        assert run["signals"]["calls"] == {"mean": 351.0, "min": 301.0, "max": 401.0}
        assert run["signals"]["half"] == {"mean": 0.5, "min": 0.5, "max": 0.5}
    table = pyarrow.parquet.read_table("x/runs.parquet")
    assert table.column("signals.calls.mean").to_pylist() == [351.0, 351.0]
    main(["run", "s.toml", "--set", "law=fine.py:Late", "--set", "randomise.runs=1", "--record", "--out", "y"])
    assert "the law's own signal: 301 … 401" in capsys.readouterr().out
    t = load(Path("y/trajectory.npz"))
    np.testing.assert_array_equal(t.signals["calls"], np.arange(1, 501))
    assert np.isnan(t.signals["half"][:200]).all()
    temporal, _ = read(Path("y/recording.rrd"), "/s/series/signal_half")
    times, values = temporal["Scalars:scalars"]
    assert len(times) == 299
    assert {float(np.ravel(value)[0]) for value in values} == {0.5}


@pytest.mark.parametrize(
    ("signals", "words"),
    [
        ("[1, 2]", "expected a dict"),
        ("{'a/b': 0.0}", "letters, digits"),
        ("{3: 0.0}", "letters, digits"),
        ("{f's{i}': 0.0 for i in range(65)}", "at most 64"),
    ],
)
def test_signals_that_are_none(capsys, signals, words):
    write("l.py", f"class Mine:\n    def __init__(self, setup):\n        self.signals = {signals}\n\n"
          "    def torques(self, sensed):\n        return [0.0] * 6\n")  # fmt: skip
    write("s.toml", SHORT)
    assert main(["run", "s.toml", "--set", "law=l.py:Mine"]) == 2
    assert words in capsys.readouterr().err
    assert not Path("runs").exists()


def test_signals_that_become_something_else(capsys):
    write("l.py", "class Mine:\n    def __init__(self, setup):\n        self.signals = {'a': 0.0}\n\n"
          "    def torques(self, sensed):\n        self.signals = {} if sensed.time > 0.1 else {'a': 1}\n"
          "        return [0.0] * 6\n")  # fmt: skip
    write("s.toml", SHORT)
    assert main(["run", "s.toml", "--set", "law=l.py:Mine", "--out", "x"]) == 1
    assert "left no signals at 0.101 s" in capsys.readouterr().out


def test_new_writes_a_law_that_runs(capsys):
    assert main(["new", "controller", "mine.py"]) == 0
    assert "law=mine.py:Law" in capsys.readouterr().out
    text = Path("mine.py").read_text(encoding="utf-8")
    assert "--set law=mine.py:Law" in text
    assert "my_law" not in text
    write("s.toml", SHORT)
    assert main(["run", "s.toml", "--set", "law=mine.py:Law", "--out", "x"]) == 0
    assert load(Path("x/trajectory.npz")).end == "completed"
    for again, words in (("mine.py", "is there already"), ("mine.toml", "Python module"), ("no/such.py", "cannot")):
        assert main(["new", "controller", again]) == 2
        assert words in capsys.readouterr().err
    assert Path("mine.py").read_text(encoding="utf-8") == text
