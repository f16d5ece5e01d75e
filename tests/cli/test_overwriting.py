"""No command writes over results, over what it reads, or into the folder of another command."""

from __future__ import annotations

import json
import os
import re
from hashlib import sha256
from itertools import product
from pathlib import Path

import pytest

from biped.base.errors import InputError
from biped.base.writing import RESULTS, Kind, may_write
from biped.cli.main import main
from biped.scenario.reading import to_toml
from biped.show.recording import record
from biped.studies.run import plan_of
from tests.cases import write

LEVEL = 'duration = 0.3\nexpect.falls = { max = 1 }\ndescription = "made"\n'


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with results of two commands, a scenario and a page that only looks like one."""
    where = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        write("s.toml", LEVEL)
        write("own.html", "<!DOCTYPE html>my own page")
        write("own.md", "# my own notes")
        write("own.xml", "<mujoco/>")
        write("own.gif", "my own clip")
        os.mkfifo("pipe.html")
        assert main(["run", "s.toml", "--out", "r", "--record"]) == 0
        assert main(["run", "s.toml", "--out", "c", "--jobs", "1", "--set", "randomise.runs=2"]) == 0
        assert main(["diff", "r", "r/../c", "--out", "d"]) in (0, 1)
    return where


def everything(folder: Path) -> dict[str, str]:
    files = (path for path in folder.rglob("*") if not path.is_dir())
    return {str(path): sha256(path.read_bytes()).hexdigest() if path.is_file() else "" for path in files}


WRITERS = (
    ("report", "r", "--html", "{}"),
    ("report", "r", "--out", "{}"),
    ("check", "s.toml", "--junit", "{}"),
    ("video", "r", "--out", "{}", "--to", "0.05"),
    ("diff", "r", "c", "--html", "{}"),
    ("new", "controller", "{}"),
)
FILES = ("s.toml", "own.html", "own.md", "own.xml", "own.gif", "pipe.html", "/dev/null", "r/scenario.toml",
         "r/result.json", "r/trajectory.npz", "r/recording.rrd", "r/runs.parquet", "c/runs.jsonl", "d/diff.json",
         "d/diff.md", "r", "r/runs.jsonl", "r/parts")  # fmt: skip


@pytest.mark.parametrize(("writer", "file"), list(product(WRITERS, FILES)), ids=lambda one: str(one).replace("/", "-"))
def test_no_file_is_written_over(made, writer, file, monkeypatch, capsys):
    monkeypatch.chdir(made)
    before = everything(made)
    assert main([word.format(file) for word in writer]) == 2
    error = capsys.readouterr().err
    assert file in error
    assert "expected" in error
    assert error.count("\n") == 1
    assert everything(made) == before


FILLERS = (
    ("run", "s.toml", "--set", "duration=0.2", "--out", "{}"),
    ("compare", "s.toml", "--out", "{}"),
    ("standard", "normal", "--out", "{}"),
    ("stability", "s.toml", "--out", "{}"),
    ("tune", "tune/quick", "--out", "{}"),
    ("export", "r", "--eurobench", "{}"),
    ("diff", "normal", "fast", "--scenario", "s.toml", "--out", "{}"),
    ("diff", "r", "c", "--out", "{}"),
)


@pytest.mark.parametrize(("filler", "folder"), list(product(FILLERS, ("r", "c", "."))), ids=str)
def test_no_folder_of_another_command_is_filled(made, filler, folder, monkeypatch, capsys):
    monkeypatch.chdir(made)
    before = everything(made)
    assert main([word.format(folder) for word in filler]) == 2
    assert f"{folder}: already holds" in capsys.readouterr().err
    assert everything(made) == before


def test_a_search_a_comparison_and_runs_of_one_scenario_do_not_share_a_folder(tmp_path, monkeypatch, capsys):
    """The scenario in all three folders is the same to the last byte."""
    monkeypatch.chdir(tmp_path)
    for argv, left in (
        (("run", "tune/quick"), ("scenario.toml", "trajectory.npz")),
        (("tune", "tune/quick"), ("scenario.toml", "gait.toml")),
        (("compare", "tune/quick"), ("scenario.toml", "comparison.json")),
    ):
        text = to_toml(plan_of("tune/quick", []).scenario)
        folder = Path("-".join((argv[0], "made")))
        folder.mkdir()
        for name in left:
            (folder / name).write_text(text, encoding="utf-8")
        for other in {"run", "tune", "compare"} - {argv[0]}:
            assert main([other, *argv[1:], "--out", str(folder)]) == 2
            assert f"{folder}: already holds something else" in capsys.readouterr().err
        assert {path.name for path in folder.iterdir()} == set(left)


def test_figures_of_a_bench_are_not_put_among_results(made, monkeypatch, capsys):
    monkeypatch.chdir(made)
    before = everything(made)
    assert main(["bench", "robot", "--out", "r"]) == 2
    assert "--out r: holds results" in capsys.readouterr().err
    assert everything(made) == before


def untimed(file: Path) -> bytes:
    """A file without the times that JUnit's XML says."""
    return re.sub(rb'time="[^"]*"', b"", file.read_bytes())


def test_what_the_same_command_wrote_is_replaced(made, monkeypatch, tmp_path):
    monkeypatch.chdir(made)
    for argv, file in (
        (["report", "r", "--html", "{}"], "a.html"),
        (["report", "r", "--out", "{}"], "a.md"),
        (["check", "s.toml", "--junit", "{}"], "a.xml"),
        (["diff", "r", "c", "--html", "{}"], "b.html"),
    ):
        out = tmp_path / file
        words = [word.format(out) for word in argv]
        assert main(words) in (0, 1)
        first = untimed(out)
        assert main(words) in (0, 1)
        assert untimed(out) == first
        out.write_bytes(b"")  # as mktemp leaves it
        assert main(words) in (0, 1)
        assert untimed(out) == first
    d = str(tmp_path / "d")
    assert main(["diff", "r", "c", "--out", d]) in (0, 1)
    assert main(["diff", "r", "c", "--out", d]) in (0, 1)


def test_reports_of_folders_of_one_name_have_figures_of_their_own(made, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    Path("a").mkdir()
    Path("b").mkdir()
    for parent, source in (("a", "r"), ("b", "c")):
        (Path(parent) / "x").symlink_to(made / source)
        Path(parent, "same").mkdir()
        for file in (made / source).iterdir():
            if file.is_file():
                (Path(parent) / "same" / file.name).write_bytes(file.read_bytes())
    assert main(["report", "a/same", "b/same", "--out", "both.md"]) == 0
    assert {path.name for path in Path("both").iterdir()} == {"same", "same-2"}


def test_a_recording_replaces_recordings_alone(tmp_path):
    mine = tmp_path / "scenario.toml"
    mine.write_text("duration = 1.0", encoding="utf-8")
    with pytest.raises(InputError, match=r"is there already and is not a recording"):
        record(mine, [], title="x")
    assert mine.read_text(encoding="utf-8") == "duration = 1.0"


def test_every_folder_of_results_is_recognised(made):
    for name in ("r", "c", "d"):
        assert {path.name for path in (made / name).iterdir()} & RESULTS
    assert json.loads((made / "r/result.json").read_bytes())["scenario"] == "s"


def test_a_link_that_leads_nowhere_and_a_new_name_may_be_written(tmp_path):
    kind = Kind("a page", (".html",), (b"made",))
    (tmp_path / "link.html").symlink_to(tmp_path / "nowhere")
    may_write(tmp_path / "link.html", "--html", kind)
    may_write(tmp_path / "new.HTML", "--html", kind)
    with pytest.raises(InputError, match=r"expected a file \*\.html"):
        may_write(tmp_path / "new.json", "--html", kind)
