"""Shares of a campaign: the same bytes whoever made them in whatever pieces, in any order, in one folder or several."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from biped.cli.main import main
from biped.ensemble import campaign
from biped.ensemble.chunks import Shard, shard_of
from biped.ensemble.guard import Lock
from biped.studies import run as running
from tests.cases import command, contents
from tests.ensemble.campaigns import of_results, run

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.usefixtures("folder")


@pytest.mark.parametrize("many", [False, True])
def test_any_way_leads_to_the_same_bytes(many, undisturbed, monkeypatch):
    if many:
        monkeypatch.setattr(running, "LARGE", 3)
    whole = of_results(run("whole", "--jobs", "1", "--shard", "1/1"))
    assert of_results(run("pool", "--jobs", "2", "--shard", "1/1")) == whole
    for number in (2, 4, 1, 3):
        assert not Path("shards/result.json").exists()
        run("shards", "--jobs", "1", "--shard", f"{number}/4")
    assert of_results(contents("shards")) == whole
    if many:
        assert of_results(run("plain", "--jobs", "2")) == whole
    else:
        assert {name: whole[name] for name in ("result.json", "runs.parquet")} == {
            name: undisturbed[name] for name in ("result.json", "runs.parquet")
        }


def test_shards_that_were_copied_together_are_one_campaign(undisturbed):
    for number in (1, 2, 3):
        run(f"machine{number}", "--jobs", "1", "--shard", f"{number}/3")
    there = Path("all/parts")
    there.mkdir(parents=True)
    Path("machine1/scenario.toml").rename("all/scenario.toml")
    for number in (1, 2, 3):
        for path in Path(f"machine{number}/parts").iterdir():
            path.rename(there / path.name)
    monkey = pytest.MonkeyPatch()
    with monkey.context() as patch:
        patch.setattr(campaign, "simulate", pytest.fail)
        patch.setattr(running, "keep_some", lambda *_: None)
        files = run("all", "--jobs", "1")
    assert files["result.json"] == undisturbed["result.json"]


def test_a_shard_says_how_far_the_campaign_is(capsys):
    code, told = command(capsys, "run", "e.toml", "--jobs", "1", "--out", "x", "--shard", "2/3")
    assert code == 0
    assert told == {"scenario": "e", "shard": "2/3", "runs": 2, "left": 4, "folder": "x"}


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "1/0", "-1/3", "1/3/4", "a/b", "1/99999999999"])
def test_what_is_no_shard(text, capsys):
    assert main(["run", "e.toml", "--out", "x", f"--shard={text}"]) == 2
    assert "expected I/N with 1 <= I <= N, such as 3/40" in capsys.readouterr().err
    assert main(["run", "e.toml", "--shard", "1/2"]) == 2
    assert "--shard: expected with one scenario and --out" in capsys.readouterr().err


def test_shards_have_every_run_once():
    for total, of in ((6, 4), (3, 7), (1000, 40)):
        runs = [number for i in range(of) for number in Shard(i + 1, of).runs(total)]
        assert runs == list(range(total))
    assert shard_of("3/40") == Shard(3, 40)


def test_shards_share_a_folder_and_nobody_else_does(capsys):
    run("x", "--jobs", "1", "--shard", "1/2")
    others = [Lock(Path("x"), Path("x"), shared=True), Lock(Path("x"), Path("x"), name=".lock-1-of-2")]
    held = subprocess.Popen(
        [sys.executable, "-c", _HOLD], env=os.environ | {"PYTHONPATH": str(ROOT)}, stdin=subprocess.PIPE,
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    for lock in reversed(others):
        lock.release()
    assert held.stdout.readline() == "held\n"
    capsys.readouterr()
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 2
    assert "another command is at work in it" in capsys.readouterr().err
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x", "--shard", "1/2"]) == 2
    assert "another command is at work in it" in capsys.readouterr().err
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x", "--shard", "2/2"]) == 0, "but another shard may"
    assert "others are at work" in capsys.readouterr().out
    assert not Path("x/result.json").exists(), "whoever is last ends the campaign"
    held.communicate("\n")
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x", "--shard", "1/2"]) == 0
    assert Path("x/result.json").exists()


_HOLD = """
import sys
from pathlib import Path
from biped.ensemble.guard import Lock
locks = [Lock(Path('x'), Path('x'), shared=True), Lock(Path('x'), Path('x'), name='.lock-1-of-2')]
print('held', flush=True)
sys.stdin.readline()
"""


def test_a_campaign_goes_on_from_a_journal_and_from_files(undisturbed, monkeypatch):
    """Begun by processes here, it goes on in shards; begun in shards, it goes on by processes here."""
    run("x", "--jobs", "1")
    lines = Path("x/runs.jsonl").read_bytes().splitlines(keepends=True)
    Path("x/runs.jsonl").write_bytes(b"".join([*lines[:3], lines[5]]))
    Path("x/result.json").unlink()
    simulate, made = campaign.simulate, []
    with monkeypatch.context() as patch:
        patch.setattr(campaign, "simulate", lambda run: made.append(run.index) or simulate(run))
        patch.setattr(running, "keep_some", lambda *_: None)
        assert run("x", "--jobs", "1", "--shard", "1/1")["result.json"] == undisturbed["result.json"]
    assert made == [2, 3, 5]
    run("y", "--jobs", "1", "--shard", "1/2")
    assert run("y", "--jobs", "2")["result.json"] == undisturbed["result.json"]
