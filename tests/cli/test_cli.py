"""The command line: one run, its folder and its numbers."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from biped.base.files import names
from biped.cli.main import main
from biped.measure.stored import load
from biped.scenario.metrics import METRICS
from tests.cases import SHORT, command, contents, write

ROOT = Path(__file__).parents[2]

AGREED = {"scenario", "engine", "passed", "runs", "checks"}
AGREED_OF_A_RUN = {
    "index", "seed", "fell", "time", "distance", "speed", "cost_of_transport", "cost_of_transport_absolute",
    "cost_of_transport_positive", "double_support", "steps",
}  # fmt: skip
AGREED_OF_A_CHECK = {"name", "value", "expected", "passed", "why"}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_json_has_the_agreed_keys(capsys):
    write("s.toml", SHORT + "[expect]\nspeed = { min = -5.0 }\nfalls = { max = 0 }\n")
    code, result = command(capsys, "run", "s.toml")
    assert code == 0
    assert set(result) >= AGREED
    assert (result["scenario"], result["engine"], result["passed"]) == ("s", "mujoco", True)
    (run,) = result["runs"]
    assert set(run) >= AGREED_OF_A_RUN | set(METRICS) - {"falls"}
    assert [set(check) for check in result["checks"]] == [AGREED_OF_A_CHECK] * 2
    assert [check["name"] for check in result["checks"]] == ["speed", "falls"]
    assert (run["index"], run["fell"], run["time"]) == (0, False, 0.5)
    assert run["seed"] == result["runs"][0]["seed"] > 0


def test_several_scenarios_give_one_object(capsys):
    for name in ("a.toml", "b.toml"):
        write(name, SHORT)
    code, result = command(capsys, "run", "a.toml", "b.toml")
    assert code == 0
    assert [one["scenario"] for one in result["results"]] == ["a", "b"]
    assert Path("runs/a/result.json").is_file()
    assert Path("runs/b/result.json").is_file()


def test_results_folder(capsys):
    import pyarrow.parquet

    write("s.toml", SHORT)
    _, result = command(capsys, "run", "s.toml", "--out", "x")
    assert set(contents("x")) == {"scenario.toml", "result.json", "runs.parquet", "trajectory.npz"}
    assert json.loads(Path("x/result.json").read_text(encoding="utf-8")) == result
    (row,) = pyarrow.parquet.read_table("x/runs.parquet").to_pylist()
    assert row["speed"] == result["runs"][0]["speed"]
    t = load(Path("x/trajectory.npz"))
    assert len(t) == 500
    assert t.q[-1, 0] - t.q[0, 0] == result["runs"][0]["distance"]


def test_new_folder_for_every_run():
    write("s.toml", SHORT)
    for _ in range(3):
        assert main(["run", "s.toml"]) == 0
    assert sorted(p.name for p in Path("runs").iterdir()) == ["s", "s-2", "s-3"]


def test_same_command_twice_same_bytes():
    write("s.toml", SHORT)
    for out in "ab":
        assert main(["run", "s.toml", "--out", out]) == 0
    assert contents("a") == contents("b")


def test_same_command_in_another_process_same_bytes():
    write("s.toml", SHORT)
    assert main(["run", "s.toml", "--out", "a"]) == 0
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONHASHSEED": "5"}
    argv = [sys.executable, "-m", "biped.cli.main", "run", "s.toml", "--out", "b"]
    subprocess.run(argv, env=environment, check=True, capture_output=True)
    assert contents("a") == contents("b")


def test_effective_scenario_gives_the_same_numbers(capsys):
    """The saved scenario needs no --set, no parent and no gait file of the user's."""
    write("g.toml", 'extends = "normal"\ntheta_b = 84.0\n')
    write("base.toml", SHORT + "[ground]\nfriction = 2.0\n")
    write("s.toml", 'extends = "base.toml"\ncontroller = "g.toml"\n')
    _, first = command(capsys, "run", "s.toml", "--set", "ground.slope=2", "--out", "a")
    Path("g.toml").write_text('extends = "normal"\ntheta_b = 50.0\n', encoding="utf-8")
    Path("base.toml").unlink()
    _, again = command(capsys, "run", "a/scenario.toml", "--out", "b")
    assert again["runs"] == first["runs"]
    assert contents("a")["trajectory.npz"] == contents("b")["trajectory.npz"]
    assert contents("a")["scenario.toml"] == contents("b")["scenario.toml"]


def test_effective_scenario_runs_from_another_folder(capsys, tmp_path, monkeypatch):
    write("g.toml", 'extends = "normal"\ntheta_b = 84.0\n')
    write("s.toml", SHORT.replace('"normal"', '"g.toml"'))
    _, first = command(capsys, "run", "s.toml", "--out", "a")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert command(capsys, "run", "../a/scenario.toml")[1]["runs"] == first["runs"]


def effective(argv: list[str]) -> dict:
    import tomllib

    assert main(["run", *argv, "--out", "x"]) in (0, 1)
    return tomllib.loads(Path("x/scenario.toml").read_text(encoding="utf-8"))


def test_command_line_over_file_over_parent_over_defaults():
    write("base.toml", SHORT + "[ground]\nfriction = 2.0\nslope = 1.0\nangles = 'slope'\n")
    write("s.toml", "extends = 'base.toml'\nground = { slope = 2.0, damping_ratio = 0.9 }\n")
    ground = effective(["s.toml", "--set", "ground.damping_ratio=0.8"])["ground"]
    assert ground["friction"] == 2.0
    assert ground["slope"] == 2.0
    assert ground["damping_ratio"] == 0.8
    assert ground["angles"] == "slope"
    assert ground["contact_time"] == 0.004


def test_values_of_set():
    write("s.toml", SHORT)
    changes = ["start.posture=flat", "push=[{at=0.1,duration=0.2,force=[200.0,0.0]}]", "seed=3",
               "actuation.single_tangential=true", "description='two words'"]  # fmt: skip
    data = effective(["s.toml", *(word for change in changes for word in ("--set", change))])
    assert data["start"]["posture"] == "flat"
    (push,) = data["push"]
    assert push | {"at": 0.1, "duration": 0.2, "force": [200.0, 0.0], "body": "torso", "shape": "constant"} == push
    assert (data["seed"], data["actuation"]["single_tangential"], data["description"]) == (3, True, "two words")


def test_later_set_wins():
    write("s.toml", SHORT)
    assert effective(["s.toml", "--set", "seed=1", "--set", "seed=2"])["seed"] == 2


def test_a_push_list_replaces_the_parents():
    write("base.toml", SHORT + "[[push]]\nat = 0.1\nduration = 0.1\nforce = [1.0, 0.0]\n")
    write("s.toml", "extends = 'base.toml'\npush = []\n")
    assert effective(["s.toml"])["push"] == []


@pytest.mark.parametrize(("bound", "code"), [("{ min = -9.0 }", 0), ("{ min = 9.0 }", 1)])
def test_check(bound, code, capsys):
    write("s.toml", SHORT + f"[expect]\nspeed = {bound}\n")
    assert main(["check", "s.toml", "--junit", "r.xml", "--summary", "s.md"]) == code
    (row,) = [line for line in Path("s.md").read_text(encoding="utf-8").splitlines() if "| speed |" in line]
    assert row.split(" | ")[-1] == ("passed |" if code == 0 else "**failed** |")
    assert ("pass" if code == 0 else "FAIL") in capsys.readouterr().out
    assert ElementTree.parse("r.xml").getroot().find("testsuite").get("failures") == str(code)
    assert not Path("runs").exists()
    assert command(capsys, "check", "s.toml")[1]["passed"] == (code == 0)


def test_check_in_several_engines(capsys):
    write("s.toml", SHORT + "[expect]\nfalls = { max = 1 }\n")
    assert main(["check", "s.toml", "--engines", "mujoco,home"]) == 0
    out = capsys.readouterr().out
    assert "in mujoco" in out
    assert "in home" in out


@pytest.mark.parametrize("argv", [
    ("--engines", "mujoco,mujoco"), ("--engines", "mujoco,mojoco"), ("--engines", "home", "--engine", "home"),
])  # fmt: skip
def test_check_in_engines_that_there_are_not(argv, capsys):
    write("s.toml", SHORT + "[expect]\nfalls = { max = 1 }\n")
    assert main(["check", "s.toml", *argv]) == 2
    assert "--engines: expected" in capsys.readouterr().err


def test_a_fall_without_expectations_fails():
    write("s.toml", SHORT.replace("0.5", "2.0") + "[actuation]\ntorque_limit = 1.0\n")
    assert main(["run", "s.toml"]) == 1


def test_list(capsys):
    assert main(["list"]) == 0
    lines = capsys.readouterr().out
    for kind in ("models", "controllers", "scenarios"):
        assert f"{kind}/" in lines
        for name in names(kind):
            line = next(line for line in lines.splitlines() if line.split()[:1] == [name])
            assert len(line.split()) > 2, f"{name} has no line about it"


def test_a_run_imports_only_what_it_uses():
    """Recordings, figures and quadratic programs cost time to import: a plain run must not pay for them."""
    write("s.toml", SHORT)
    code = (
        "import sys; from biped.cli.main import main; main(['run', 's.toml', '--out', 'x']);"
        "print([name for name in ('rerun', 'matplotlib', 'qpsolvers', 'osqp', 'cma') if name in sys.modules])"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_help_imports_next_to_nothing():
    code = (
        "import sys; from biped.cli.main import main\n"
        "try: main(['run', '--help'])\n"
        "except SystemExit: pass\n"
        "print([name for name in ('numpy', 'mujoco', 'pinocchio', 'numba', 'rich') if name in sys.modules])"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_bounded_torques_stay_within_their_limit():
    write("s.toml", SHORT + "[actuation]\ntorque_limit = 60.0\nlimit = 'bounded'\n")
    assert main(["run", "s.toml", "--out", "x"]) in (0, 1)
    u = load(Path("x/trajectory.npz")).u
    assert np.abs(u).max() <= 60.0
    assert (np.abs(u) > 59.99).any(), "the limit was never reached: nothing was tested"
