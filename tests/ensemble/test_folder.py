"""Results folders: nothing of the user's is removed or overwritten, whatever --out says and however a command ends."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from biped.base.errors import InputError
from biped.cli.main import main
from biped.ensemble import campaign
from biped.ensemble.folder import Folder
from biped.ensemble.guard import LONGEST, holds_something_else, slug
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from tests.cases import ENSEMBLE, SHORT, contents, write

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder of the user's, with what matters to them in it."""
    (tmp_path / "mine/thesis").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "mine")
    write("thesis/chapter.tex", "years of work")
    write("notes.txt", "text")
    write("s.toml", SHORT)


@pytest.fixture(params=[InputError("law: raises", "law"), KeyboardInterrupt()], ids=["bad input", "Ctrl-C"])
def failing(request, monkeypatch):
    """Every run ends the command."""

    def simulate(run):
        raise request.param

    monkeypatch.setattr(campaign, "simulate", simulate)


def everything() -> dict[str, bytes]:
    return contents("..") | {str(p): b"" for p in Path("..").rglob("*") if p.is_dir()}


@pytest.mark.parametrize("out", ["new/..", "new/../", "./new/../.", "new/../../mine", "thesis/..", ".", "thesis"])
def test_out_that_leads_to_the_users_folder(out, failing, capsys):
    before = everything()
    assert main(["run", "s.toml", "--out", out]) == 2
    assert "already holds something else" in capsys.readouterr().err
    assert everything() == before


@pytest.mark.parametrize("out", ["new", "new/deep", "there", "new/../other/deep"])
def test_what_fails_leaves_nothing(out, failing):
    Path("there").mkdir()
    before = everything()
    assert main(["run", "s.toml", "--out", out]) in (2, 130)
    assert everything() == before


@pytest.mark.parametrize("name", ["...toml", "....toml", "-.toml", "a b.toml"])
@pytest.mark.parametrize("runs", [False, True], ids=["no runs/", "runs/"])
def test_a_scenario_file_of_a_strange_name(name, runs, failing, capsys):
    write(name, SHORT)
    if runs:
        Path("runs/of mine").mkdir(parents=True)
        write("runs/of mine/notes.txt", "text")
    before = everything()
    assert main(["run", "./" + name]) in (2, 130)
    assert everything() == before


def test_results_of_a_strange_name_have_a_folder_of_their_own():
    write("...toml", SHORT)
    before = everything()
    assert main(["run", "...toml"]) == 0
    assert {path: before[path] for path in before} == {path: everything()[path] for path in before}
    assert [path.name for path in Path("runs").iterdir()] == ["scenario"]


def test_other_results_are_never_overwritten(capsys):
    assert main(["run", "s.toml", "--set", "seed=1", "--out", "old"]) == 0
    before = everything()
    capsys.readouterr()
    for out in ("nodir/../old", "old/../old", "./old/."):
        assert main(["run", "s.toml", "--set", "seed=2", "--out", out]) == 2
        assert "already holds something else" in capsys.readouterr().err
        assert everything() == before


def test_a_link_is_what_it_leads_to(failing, capsys):
    Path("link").symlink_to("thesis")
    Path("empty").mkdir()
    Path("to empty").symlink_to("empty")
    Path("dangling").symlink_to("nowhere")
    before = everything()
    for out in ("link", "link/../thesis", "to empty", "dangling"):
        assert main(["run", "s.toml", "--out", out]) in (2, 130)
        assert everything() == before


def test_what_others_put_there_meanwhile_stays(monkeypatch):
    def simulate(run):
        write("new/deep/theirs.txt", "text")
        raise KeyboardInterrupt

    monkeypatch.setattr(campaign, "simulate", simulate)
    assert main(["run", "s.toml", "--out", "new/deep"]) == 130
    assert contents("new") == {"deep/theirs.txt": b"text"}


def test_kept_failures_of_runs_that_were_never_noted_go(monkeypatch):
    write("e.toml", ENSEMBLE)

    def note(self, record):
        raise KeyboardInterrupt

    monkeypatch.setattr(Folder, "note", note)
    before = everything()
    assert main(["run", "e.toml", "--jobs", "2", "--out", "x"]) == 130
    assert everything() == before


def test_a_noted_row_is_never_discarded(monkeypatch, capsys):
    """Run 3 cannot be run: what the others came to is worth a day of work all the same."""
    write("e.toml", ENSEMBLE)
    simulate = campaign.simulate

    def sometimes(run):
        if run.index == 3:
            raise InputError("law: raises", "law")
        return simulate(run)

    monkeypatch.setattr(campaign, "simulate", sometimes)
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 2
    assert "finished runs are kept in x/" in capsys.readouterr().err
    assert len(Path("x/runs.jsonl").read_bytes().splitlines()) == 1 + 3
    # What was there before this command is not its own either.
    monkeypatch.setattr(campaign, "simulate", lambda run: (_ for _ in ()).throw(InputError("law: raises", "law")))
    before = contents("x")
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 2
    assert contents("x") == before


def test_runs_of_one_scenario_do_not_overwrite_each_other(capsys):
    write("e.toml", ENSEMBLE)
    assert main(["run", "e.toml", "--jobs", "1", "--out", "all"]) == 0
    assert main(["run", "e.toml", "--only", "2", "--out", "one"]) == 0
    before = everything()
    capsys.readouterr()
    for out, rest in (("all", ["--only", "2"]), ("one", []), ("one", ["--only", "3"])):
        assert main(["run", "e.toml", "--jobs", "1", "--out", out, *rest]) == 2
        assert "already holds other runs of this scenario" in capsys.readouterr().err
    assert everything() == before
    assert main(["run", "e.toml", "--only", "2", "--out", "one"]) == 0
    assert everything() == before


@pytest.mark.parametrize(
    ("title", "name"),
    [("thesis/level", "thesis-level"), ("..", "scenario"), ("", "scenario"), ("/", "scenario"), (".a", "a"),
     ("-x", "x"), ("a b\n", "a-b"), ("über", "über"), ("x" * 300, "x" * LONGEST), ("ü" * 300, "ü" * (LONGEST // 2)),
     ("level_normal-2", "level_normal-2"), ("a\0b", "a-b")],
)  # fmt: skip
def test_slugs(title, name):
    assert slug(title) == name


@pytest.mark.parametrize("out", ["a\0b", "x" * 300, "/proc/biped", "notes.txt/x"])
def test_folders_that_cannot_be(out, capsys):
    before = everything()
    assert main(["run", "s.toml", "--out", out]) == 2
    error = capsys.readouterr().err
    assert "cannot be written: " in error
    assert error.count("\n") == 1
    assert everything() == before


def test_a_working_folder_that_was_deleted():
    argv = f"mkdir gone && cd gone && rmdir ../gone && exec {sys.executable} -m biped.cli.main run level_normal"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(["sh", "-c", argv], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "biped: the working folder was deleted; expected to be called from one that exists\n"


def test_a_results_folder_that_is_deleted_while_it_is_filled(monkeypatch, capsys):
    import shutil

    write("e.toml", ENSEMBLE)
    simulate = campaign.simulate

    def deleting(run):
        shutil.rmtree("x", ignore_errors=True)
        return simulate(run)

    monkeypatch.setattr(campaign, "simulate", deleting)
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 1
    error = capsys.readouterr().err
    assert "x/" in error
    assert "cannot be written: no such file or directory" in error
    assert error.count("\n") == 1


def test_new_folders_of_commands_that_start_together():
    plan = Plan(read_scenario("s.toml"))
    first, second = (Folder.new(Path("runs"), "s", plan) for _ in range(2))
    assert (first.path.name, second.path.name) == ("s", "s-2")
    second.discard()
    first.discard()
    assert not Path("runs").exists()


def test_who_begins_at_the_same_moment_is_no_stranger(tmp_path, monkeypatch):
    """Its scenario comes while the folder is looked at; the lock says what is to be said of it."""
    iterdir, there = Path.iterdir, tmp_path / "scenario.toml"

    def late(self):
        there.write_text("seed = 1", encoding="utf-8")
        return iterdir(self)

    monkeypatch.setattr(Path, "iterdir", late)
    assert not holds_something_else(tmp_path, "seed = 1")
    assert holds_something_else(tmp_path, "seed = 2")
