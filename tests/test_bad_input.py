"""Whatever a user gets wrong: one paragraph that says where and what was expected, exit code 2, nothing written."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from biped.cli.main import main
from tests.bad import HUMAN, KINDS, LAWS, Bad


def prepared(bad: Bad, folder: Path) -> set[Path]:
    """Writes what the user has; returns every path below the folder."""
    for name, text in {"s.toml": bad.scenario, **bad.files}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(text, bytes):
            path.write_bytes(text)
        else:
            path.write_text(text, encoding="utf-8")
    return everything(folder)


def everything(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if path.name != "__pycache__" and path.suffix != ".pyc"}


def assert_good_answer(bad: Bad, code: int, out: str, err: str) -> None:
    assert code == 2, err
    assert out == ""
    assert "Traceback" not in err
    for fragment in bad.says:
        assert fragment in err
    assert err.startswith("biped: ")
    assert err.count("\n") == 1, "one paragraph"
    assert len(err) < 700


@pytest.mark.parametrize("bad", KINDS, ids=[bad.name for bad in KINDS])
def test_bad_input(bad, tmp_path, monkeypatch, capsys):
    there = prepared(bad, tmp_path)
    monkeypatch.chdir(tmp_path)
    code = main(bad.argv)
    answer = capsys.readouterr()
    assert_good_answer(bad, code, *answer)
    assert everything(tmp_path) == there, "something was left behind"


def test_there_are_enough_kinds():
    assert len({bad.name for bad in KINDS}) == len(KINDS) >= 30


BY_NAME = {bad.name: bad for bad in KINDS}


@pytest.mark.parametrize("name", ["unknown key", "unknown command", "law that raises", "folder below a file"])
def test_bad_input_of_the_real_command(name, tmp_path):
    bad = BY_NAME[name]
    there = prepared(bad, tmp_path)
    root = Path(__file__).parent.parent
    done = subprocess.run(
        [sys.executable, "-m", "biped.cli.main", *bad.argv],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(root)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert_good_answer(bad, done.returncode, done.stdout, done.stderr)
    assert everything(tmp_path) == there


def test_law_that_fails_in_a_worker(tmp_path, monkeypatch, capsys):
    """The complaint crosses from the process that found it; what was finished before is kept, and nothing else."""
    bad = next(bad for bad in LAWS if bad.name == "law that raises in one run of many")
    prepared(bad, tmp_path)
    monkeypatch.chdir(tmp_path)
    code = main(["run", "s.toml", "--trust", "--jobs", "2", "--out", "deep/down"])
    answer = capsys.readouterr()
    assert_good_answer(bad, code, *answer)
    noted = Path("deep/down/runs.jsonl").exists()
    assert noted == ("finished runs are kept in deep/down/" in answer.err)
    kept = {path.name for path in Path().glob("deep/down/*")}
    assert kept - {"failures"} == ({"scenario.toml", "runs.jsonl"} if noted else set())


def test_good_input_is_not_refused(tmp_path, monkeypatch, capsys):
    """The model edits above are faults, not the act of having a model of one's own."""
    monkeypatch.chdir(tmp_path)
    Path("m.xml").write_text(HUMAN, encoding="utf-8")
    Path("s.toml").write_text('model = "m.xml"\nduration = 0.05', encoding="utf-8")
    assert main(["run", "s.toml", "--json", "--out", "x"]) == 0
    assert Path("x/result.json").is_file()
