"""What lies around a command may be wrong too: one sentence says what, and nothing waits for ever."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from biped.base.errors import InputError
from biped.base.files import folder
from biped.cli.main import main
from biped.ensemble.guard import holds_something_else
from biped.ensemble.parts import listed
from tests.cases import write

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("value", ["nope", "osmesa-5"])
def test_graphics_that_are_not_there(value, tmp_path):
    env = os.environ | {"PYTHONPATH": str(ROOT), "MUJOCO_GL": value}
    done = subprocess.run([sys.executable, "-m", "biped", "run", "ci/level"], cwd=tmp_path, env=env,
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith(f"biped: MUJOCO_GL={value}: MuJoCo cannot draw with it: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("address", ["http://localhost:8786", "localhost:8786", "ftp://x:1"])
def test_an_address_of_no_scheduler(address, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write("c.toml", f'[scheduler]\naddress = "{address}"\n')
    write("s.toml", "duration = 0.1\nrandomise.runs = 2\n")
    assert main(["run", "s.toml", "--cluster", "c.toml", "--out", "r"]) == 2
    assert f"c.toml: scheduler.address: expected tcp://host:8786 or tls://…, got '{address}'" in capsys.readouterr().err


@pytest.mark.parametrize("gear", ["1e300", "-1e200", "1e7"])
def test_a_gear_beyond_all_bounds(gear, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = (folder("models") / "walker2d.xml").read_text(encoding="utf-8")
    before, _, after = text.partition('gear="')
    write("w.xml", f'{before}gear="{gear}"{after.partition(chr(34))[2]}')
    main(["model", "w.xml"])
    answer = capsys.readouterr()
    assert "expected at most 1e+06" in answer.out + answer.err
    assert "defect" not in answer.err


def test_a_pipe_among_results_is_never_opened(tmp_path):
    os.mkfifo(tmp_path / "00000-00009-abc.parquet")
    assert listed(tmp_path) == []
    assert holds_something_else(tmp_path, "seed = 1")
    (tmp_path / "00000-00009-abc.parquet").unlink()
    write(str(tmp_path / "scenario.toml"), "seed = 1")
    assert not holds_something_else(tmp_path, "seed = 1")
    os.mkfifo(tmp_path / "runs.jsonl")
    assert holds_something_else(tmp_path, "seed = 1")


def test_a_value_that_cannot_be_run_is_one_that_fails(monkeypatch):
    from biped.studies import standard as study

    made = study._plan

    def steep(test, entrant, changes, value):
        if value > test.standard.first:
            raise InputError("start: the legs cannot reach the slope")
        return made(test, entrant, changes, value)

    (test,) = study.trials_of(["standard/slope_up"])
    monkeypatch.setattr(study, "_plan", steep)
    entrant = study.entrant_of("normal")
    found = study._stand(test, entrant, [], lambda title, plan, s, value: study.TriedValue(value, 10, 10, {}))
    assert found.limit is not None
    assert found.limit.holds_to == test.standard.first
    assert found.limit.fails_at is not None
    assert all(one.reached == 0 for one in found.tried[1:])


def test_a_solver_that_is_not_installed(tmp_path, monkeypatch, capsys):
    import qpsolvers

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(qpsolvers, "available_solvers", ["osqp"])
    write("s.toml", 'duration = 0.2\nactuation = { limit = "bounded", solver = "daqp", torque_limit = 20.0 }\n')
    assert main(["run", "s.toml", "--out", "r"]) == 2
    assert "actuation.solver: 'daqp' is not installed; expected active_set" in capsys.readouterr().err


@pytest.mark.parametrize(
    "command", [["report"], ["view"], ["plot"], ["video"], ["export", "--eurobench"], ["diff", "level_normal"]]
)
def test_a_name_that_no_file_can_have(command, capsys):
    assert main([*command, "0x" + 300 * "f"]) == 2
    words = capsys.readouterr().err
    assert words.startswith("biped: ")
    assert len(words) < 1000
