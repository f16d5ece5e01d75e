"""Campaigns of many runs: their rows lie in files, and nothing that is shown of them is another."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from biped.base.errors import InputError
from biped.base.writing import dumps
from biped.cli.main import main
from biped.ensemble import campaign, merging, parts
from biped.ensemble.columns import stored_rows
from biped.ensemble.failures import SUFFIX
from biped.studies import run as running
from tests.cases import command
from tests.ensemble.campaigns import of_results, run

pytestmark = pytest.mark.usefixtures("folder")


def test_a_campaign_in_files_holds_what_result_json_held(large, undisturbed, capsys):
    files = run("x", "--jobs", "1")
    whole, result = json.loads(undisturbed["result.json"]), json.loads(files["result.json"])
    assert result == {key: value for key, value in whole.items() if key != "runs"}
    assert "runs.parquet" not in files
    assert "runs.jsonl" not in files
    rows = stored_rows(Path("x"), 6)
    assert json.loads(dumps(list(rows))) == whole["runs"]
    assert json.loads(dumps([rows[-1], rows[0]])) == [whole["runs"][5], whole["runs"][0]]
    kept = {name for name in files if name.startswith("failures/") and name.endswith(SUFFIX)}
    assert len(kept) == 3, "failures.keep"
    assert all(files[name] == undisturbed[name] for name in kept), "the first that fell"
    _, printed = command(capsys, "run", "e.toml", "--out", "x")
    assert printed == result


def test_what_is_shown_of_rows_in_files_is_what_is_shown_of_others(undisturbed, capsys, monkeypatch):
    for name in ("few", "many"):
        monkeypatch.setattr(running, "LARGE", 3 if name == "many" else 100)
        assert main(["run", "e.toml", "--jobs", "1", "--out", f"{name}/x"]) == 0
    shown = {}
    for name in ("few", "many"):
        monkeypatch.chdir(name)
        capsys.readouterr()
        assert main(["report", "x", "--out", "r.md"]) == 0
        shown[name] = Path("r.md").read_bytes(), {p.name: p.read_bytes() for p in Path("r/x").iterdir()}
        monkeypatch.chdir("..")
    assert shown["few"] == shown["many"]
    assert len(shown["many"][1]) == 3


def test_stopped_after_any_chunk_the_same_command_goes_on_to_the_same_bytes(large, monkeypatch, capsys):
    whole = of_results(run("whole", "--jobs", "1"))
    simulate, count = campaign.simulate, iter(range(100))

    def stopped(run):
        if next(count) == 3:
            raise KeyboardInterrupt
        return simulate(run)

    with monkeypatch.context() as patch:
        patch.setattr(campaign, "simulate", stopped)
        assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 130
    done = sum(part.last - part.first + 1 for part in parts.listed(Path("x/parts")))
    assert 0 < done <= 3
    made = []
    monkeypatch.setattr(campaign, "simulate", lambda run: made.append(run.index) or simulate(run))
    monkeypatch.setattr(running, "keep_some", lambda *_: None)
    assert of_results(run("x", "--jobs", "1")) == whole
    assert made == list(range(done, 6))


def test_a_run_that_costs_its_workers_is_a_file_of_its_own_until_it_is_made(undisturbed, large, monkeypatch):
    simulate = campaign.simulate

    def killed(run):
        if run.index == 3:
            os.kill(os.getpid(), 9)
        return simulate(run)

    with monkeypatch.context() as patch:
        patch.setattr(campaign, "simulate", killed)
        assert main(["run", "e.toml", "--jobs", "2", "--out", "x"]) == 1
    whole = json.loads(undisturbed["result.json"])["runs"]
    rows = json.loads(dumps(list(stored_rows(Path("x"), 6))))
    assert [row["end"] for row in rows].count("lost") == 1
    assert rows[3]["cause"] == "lost: its process was killed (SIGKILL), and so was the next"
    assert rows[:3] + rows[4:] == whole[:3] + whole[4:]
    (part,) = parts.listed(Path("x/parts"))
    assert part.about.lost == (3,)
    clean = of_results(run("clean", "--jobs", "1"))
    assert of_results(run("x", "--jobs", "1")) == clean, "a machine's misfortune is no result"


def test_results_whose_rows_are_not_all_there_are_refused(large, capsys):
    run("x", "--jobs", "1")
    (path,) = Path("x/parts").glob("*.parquet")
    path.unlink()
    for reader in (["plot", "x"], ["report", "x", "--out", "r.md"], ["view", "x"]):
        capsys.readouterr()
        assert main(reader) == 2
        err = capsys.readouterr().err
        assert err.startswith("biped: x/parts: expected the rows of 6 runs, there are 0")
        assert err.count("\n") == 1


def test_check_of_many_runs_writes_nothing(large, capsys):
    assert main(["check", "e.toml", "--jobs", "1"]) == 0
    assert {path.name for path in Path().iterdir()} == {"e.toml"}
    _, result = command(capsys, "check", "e.toml", "--jobs", "1")
    assert "runs" not in result
    assert result["summary"]["runs"] == 6


def test_large_files_are_cut_and_read_as_one(monkeypatch):
    monkeypatch.setattr(running, "LARGE", 3)
    monkeypatch.setattr(parts, "GROUP", 2)
    one = run("one", "--jobs", "1")
    monkeypatch.setattr(merging, "LARGEST", 1)
    several = run("several", "--jobs", "1")
    assert len([name for name in several if name.startswith("parts/")]) == 3
    assert several["result.json"] == one["result.json"]
    assert dumps(list(stored_rows(Path("several"), 6))) == dumps(list(stored_rows(Path("one"), 6)))


def test_stopped_while_files_are_written_anew_nothing_is_lost(large, monkeypatch):
    whole = of_results(run("whole", "--jobs", "1"))

    def stopped(*_):
        raise KeyboardInterrupt

    unlink = Path.unlink
    with monkeypatch.context() as patch:
        patch.setattr(
            Path, "unlink", lambda self, **more: stopped() if self.suffix == ".parquet" else unlink(self, **more)
        )
        assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 130
    assert len(parts.listed(Path("x/parts"))) > 1
    assert of_results(run("x", "--jobs", "1")) == whole


SQL = "SELECT count(*), avg(speed), max(index) FROM 'x/parts/*.parquet' WHERE fell"


@pytest.mark.parametrize("package", ["pyarrow", "duckdb", "polars"])
def test_rows_can_be_asked_by_other_packages(package, large):
    """As docs/clusters.md says."""
    pytest.importorskip(package)
    run("x", "--jobs", "1")
    fallen = [row for row in stored_rows(Path("x"), 6) if row["fell"]]
    if package == "pyarrow":
        import pyarrow.dataset as ds

        found = ds.dataset("x/parts").to_table(columns=["index", "time"], filter=ds.field("fell"))
        assert found["index"].to_pylist() == [row["index"] for row in fallen]
    elif package == "duckdb":
        import duckdb

        count, _, last = duckdb.sql(SQL).fetchall()[0]
        assert (count, last) == (len(fallen), fallen[-1]["index"])
    else:
        import polars

        found = polars.scan_parquet("x/parts/*.parquet").filter(polars.col("fell")).collect()
        assert found["time"].to_list() == [row["time"] for row in fallen]


def test_a_full_disk_leaves_whole_files(large, capsys, monkeypatch):
    def full(fd):
        raise OSError(28, "No space left on device")

    whole = of_results(run("whole", "--jobs", "1"))
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) in (1, 2)
    assert "no space left on device" in capsys.readouterr().err
    assert of_results(run("x", "--jobs", "1")) == whole


def test_from_python_rows_of_many_runs_are_a_table(large, undisturbed, tmp_path):
    import biped

    result = biped.run("e.toml", jobs=1)
    folder = result._done.files.path
    assert folder.is_dir()
    assert result.runs["index"].to_pylist() == list(range(6))
    whole = json.loads(undisturbed["result.json"])
    assert result.runs["time"].to_pylist() == [row["time"] for row in whole["runs"]]
    assert dumps(result.summary) == dumps(whole["summary"])
    assert len(result.replay(2)) > 0
    with pytest.raises(InputError, match="run 6: expected the number of a run, 0 … 5"):
        result.replay(6)
    result.save(tmp_path / "saved")
    assert list(stored_rows(tmp_path / "saved", 6))[5]["index"] == 5
    del result
    assert not folder.exists()
