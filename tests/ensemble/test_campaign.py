"""Ensembles: every run replayable, any number of processes, nothing finished is lost."""

from __future__ import annotations

import json
import pickle
import threading
from functools import partial
from pathlib import Path

import pytest

from biped.base.writing import dumps
from biped.cli.main import main
from biped.ensemble import backend, campaign
from biped.ensemble.campaign import Making, run_one
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from biped.studies.run import keep_ending
from tests.cases import ENSEMBLE, command, contents, write


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("e.toml", ENSEMBLE)


def test_rows_differ_and_some_fall(capsys):
    """What the other tests here rely on."""
    _, result = command(capsys, "run", "e.toml", "--jobs", "1")
    assert [run["index"] for run in result["runs"]] == list(range(6))
    assert len({run["seed"] for run in result["runs"]}) == 6
    assert len({run["values"]["ground.friction"] for run in result["runs"]}) == 6
    assert 0 < sum(run["fell"] for run in result["runs"]) < 6
    assert all(0.5 <= run["values"]["ground.friction"] <= 2.0 for run in result["runs"])


@pytest.mark.parametrize("index", [0, 4])
def test_only_replays_a_row_exactly(index, capsys):
    _, whole = command(capsys, "run", "e.toml", "--jobs", "1")
    _, alone = command(capsys, "run", "e.toml", "--only", str(index))
    assert alone["runs"] == [whole["runs"][index]]


def test_jobs_do_not_change_the_numbers():
    for jobs in "12":
        assert main(["run", "e.toml", "--jobs", jobs, "--out", jobs]) == 0
    one, two = contents("1"), contents("2")
    for name in ("result.json", "runs.parquet", "scenario.toml"):
        assert one[name] == two[name]
    kept = {name for name in one if name.endswith(".xz")}
    assert kept
    assert {name: one[name] for name in kept} == {name: two[name] for name in kept}


def test_effective_scenario_of_an_ensemble(capsys):
    _, first = command(capsys, "run", "e.toml", "--jobs", "1", "--out", "a")
    _, again = command(capsys, "run", "a/scenario.toml", "--jobs", "1")
    assert again["runs"] == first["runs"]


def test_interrupted_campaign_goes_on_to_the_same_bytes(monkeypatch, capsys):
    assert main(["run", "e.toml", "--jobs", "1", "--out", "whole"]) == 0
    simulate, count = campaign.simulate, iter(range(100))

    def stopped(run):
        if next(count) == 3:
            raise KeyboardInterrupt
        return simulate(run)

    monkeypatch.setattr(campaign, "simulate", stopped)
    capsys.readouterr()
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 130
    assert "stopped" in capsys.readouterr().err
    assert len(Path("x/runs.jsonl").read_bytes().splitlines()) == 1 + 3  # what it is about, and three rows
    assert not Path("x/result.json").exists()

    made = []
    monkeypatch.setattr(campaign, "simulate", lambda run: made.append(run.index) or simulate(run))
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 0
    assert made == [3, 4, 5]
    whole, resumed = contents("whole"), contents("x")
    for name in ("result.json", "runs.parquet"):
        assert resumed[name] == whole[name]


def test_a_campaign_killed_while_writing_a_row(monkeypatch):
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 0
    whole = contents("x")
    journal = Path("x/runs.jsonl")
    text = journal.read_text(encoding="utf-8")
    journal.write_text(text[: int(0.6 * len(text))], encoding="utf-8")
    Path("x/result.json").unlink()
    Path("x/runs.parquet").unlink()
    assert main(["run", "e.toml", "--jobs", "2", "--out", "x"]) == 0
    again = contents("x")
    for name in ("result.json", "runs.parquet"):
        assert again[name] == whole[name]
    # The torn line must not have swallowed the row after it.
    rows = [json.loads(line) for line in journal.read_text(encoding="utf-8").splitlines() if _is_row(line)]
    assert sorted(row["index"] for row in rows) == list(range(6))


def _is_row(line: str) -> bool:
    try:
        return "index" in json.loads(line)
    except json.JSONDecodeError:
        return False


def test_an_interrupted_single_run_leaves_nothing(monkeypatch):
    def stopped(run):
        raise KeyboardInterrupt

    monkeypatch.setattr(campaign, "simulate", stopped)
    assert main(["run", "e.toml", "--only", "1"]) == 130
    assert not Path("runs").exists()


def test_falls_are_kept_and_say_how_to_see_them_again(capsys):
    _, result = command(capsys, "run", "e.toml", "--jobs", "1", "--out", "x")
    fallen = [run["index"] for run in result["runs"] if run["fell"]]
    assert sorted(p.stem for p in Path("x/failures").glob("*.xz")) == [f"run-{i:05d}" for i in fallen]
    note = Path(f"x/failures/run-{fallen[0]:05d}.txt").read_text(encoding="utf-8")
    argv = note.splitlines()[1].removeprefix("again: biped ").split()
    assert command(capsys, *argv)[1]["runs"] == [result["runs"][fallen[0]]]


def test_work_can_be_sent_elsewhere(tmp_path):
    """To another machine, or a process that shares nothing: the plan is made anew there."""
    plan = Plan(read_scenario("e.toml"))
    sent = pickle.loads(pickle.dumps(Making(plan, partial(keep_ending, tmp_path))))
    assert dumps(sent(3).as_dict()) == dumps(run_one(plan, 3)[1].as_dict())
    assert (tmp_path / "failures/run-00003.xz").is_file()


def test_where_processes_do_not_fork_compiled_runs_are_made_by_threads(monkeypatch):
    plan = Plan(read_scenario("e.toml"))
    with campaign.rows_of(plan, range(len(plan)), 1) as rows:
        one = {row.index: dumps(row.as_dict()) for row in rows}
    monkeypatch.setattr(campaign, "FORKS", False)
    assert campaign.side_by_side(plan)
    made_by = set()
    keep = lambda *_: made_by.add(threading.current_thread().name)  # noqa: E731
    with campaign.rows_of(plan, range(len(plan)), 3, keep) as rows:
        assert {row.index: dumps(row.as_dict()) for row in rows} == one
    assert made_by
    assert threading.main_thread().name not in made_by


def test_bounded_torques_by_a_package_need_processes(monkeypatch):
    monkeypatch.setattr(campaign, "FORKS", False)
    solver = ["actuation.limit=bounded", "actuation.solver=osqp"]
    assert not campaign.side_by_side(Plan(read_scenario("e.toml", solver)))


@pytest.mark.slow
def test_where_processes_do_not_fork(monkeypatch):
    assert main(["run", "e.toml", "--jobs", "1", "--out", "1"]) == 0
    monkeypatch.setattr(backend, "FORKS", False)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    assert main(["run", "e.toml", "--jobs", "2", "--out", "2"]) == 0
    one, two = contents("1"), contents("2")
    assert {name: data for name, data in one.items() if name.endswith((".json", ".xz", ".parquet"))} == {
        name: data for name, data in two.items() if name.endswith((".json", ".xz", ".parquet"))
    }
