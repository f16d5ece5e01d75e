"""Costs are ratios that can be believed, and a changed result fails the benchmark that guards."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest

from biped.cli.main import main
from biped.studies.bench import parts, regress, throughput
from biped.studies.bench.regress import CHANGED, ELSEWHERE, SAME, SLOWER, UNKNOWN, judged
from biped.studies.regress import references
from biped.studies.regress.references import Cost, Reference
from tests.cases import SHORT, write


@pytest.fixture
def quick(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(parts, "REPEATS", 1)
    monkeypatch.setattr(throughput, "ENSEMBLE", 4)
    monkeypatch.setattr(throughput, "COMMANDS", (["--help"],))


def test_what_is_measured(quick, capsys):
    assert main(["bench", "throughput", "--quick", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    tick = result["tick"]
    assert min(tick["closed_loop"], tick["steps"], tick["ratio_strict"]) > 0.0
    assert tick["ratio_with_metrics"] > tick["ratio_loop"] > 0.0, "metrics are added to the loop's own time"
    assert result["campaign"]["runs"] == 4
    assert result["campaign"]["ratio"] > 0.0
    assert result["cold_start"]["biped --help"] > 0.0


REFERENCE = Reference("2026-01-01", "here", [0, 1], "ww", ["aa", "bb"], *[[None, None]] * 3)
COST = Cost("2026-01-01", "a test", 2.0, 2.5)


@pytest.mark.parametrize(
    ("reference", "bits", "expected"),
    [
        (REFERENCE, "aa", SAME),
        (REFERENCE, "bb", CHANGED),
        (msgspec.structs.replace(REFERENCE, platform="there"), "bb", ELSEWHERE),
        (None, "aa", UNKNOWN),
    ],
)
def test_the_result_is_compared_where_it_can_be(reference, bits, expected):
    assert judged("s", reference, COST, COST, bits, "here").result == expected


def test_the_worse_of_the_two_costs_counts():
    new = Cost("2026-01-02", "", 2.0, 3.0)
    assert judged("s", REFERENCE, COST, new, "aa", "here").slower == pytest.approx(0.2)
    assert judged("s", REFERENCE, None, new, "aa", "here").slower == 0.0


@pytest.fixture
def recorded(quick, monkeypatch):
    """References of one timed scenario in r.json."""
    monkeypatch.setattr(regress, "SCENARIOS", ("s.toml",))
    write("s.toml", SHORT)
    file = ["--file", "r.json"]
    assert main(["regress", "s.toml", *file, "--jobs", "1", "--update", "--reason", "a test"]) == 0
    assert main(["bench", "regress", *file, "--update", "--reason", "a test"]) == 0
    return file


def test_a_changed_result_fails_and_a_slow_one_is_reported(recorded, capsys):
    capsys.readouterr()
    path = Path("r.json")
    found = references.read(path)
    cost = found.costs["s"]
    assert cost.reason == "a test"
    assert min(cost.metrics, cost.loop) > 0.0

    # A hundredth, so that no noise of a shared machine makes up for it.
    found.costs["s"] = msgspec.structs.replace(cost, loop=cost.loop / 100.0)
    references.write(path, found)
    assert main(["bench", "regress", *recorded, "--json"]) == 0, "slow is no failure"
    (timed,) = json.loads(capsys.readouterr().out)["scenarios"]
    assert timed["result"] == SAME
    assert timed["slower"] > SLOWER

    reference = found.scenarios["s"]
    found.scenarios["s"] = msgspec.structs.replace(reference, digests=["0" * 12, *reference.digests[1:]])
    references.write(path, found)
    assert main(["bench", "regress", *recorded]) == 1
    out = capsys.readouterr().out
    assert CHANGED in out
    assert "slower by" in out
