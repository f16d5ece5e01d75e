"""Costs are ratios that can be believed, and a changed result fails the benchmark that guards."""

from __future__ import annotations

import json
import math
from pathlib import Path

import msgspec
import pytest

from biped.cli.main import main
from biped.studies.bench import parts, throughput
from biped.studies.bench.parts import shares
from biped.studies.bench.throughput import CHANGED, ELSEWHERE, SAME, SLOWER, UNKNOWN, judged
from biped.studies.regress import references
from biped.studies.regress.references import RecordedScenario, TickCost
from tests.cases import SHORT, write


@pytest.fixture
def quick(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(parts, "REPEATS", 1)
    monkeypatch.setattr(throughput, "ENSEMBLE", 4)
    monkeypatch.setattr(throughput, "STARTS", 1)
    monkeypatch.setattr(throughput, "COMMANDS", (["--help"],))


def test_what_is_measured(quick, capsys):
    assert main(["bench", "throughput", "--quick", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["tick"].keys() == shares(TIMES, 1000).keys()
    assert all(math.isfinite(value) for value in result["tick"].values())
    assert result["campaign"]["runs"] == 4
    assert result["cold_start"]["biped --help"] > 0.0


TIMES = {
    "physics": [6.0, 5.0, 12.0], "steps": [3.0, 2.5, 6.0], "tree": [1.0, 1.0, 2.0],
    "tree_and_torques": [3.0, 3.0, 6.0], "law": [4.0, 4.0, 8.0], "set_up": [0.5, 0.5, 1.0],
    "closed_loop": [9.0, 10.0, 18.0], "metrics": [3.0, 2.5, 6.0],
}  # fmt: skip
"""[ms] of three repeats, in the last of which the machine was half as fast."""


def test_parts_add_up_and_each_repeat_is_divided_by_its_own_steps():
    found = shares({name: [1e-3 * t for t in times] for name, times in TIMES.items()}, 1000)
    assert found == pytest.approx({
        "physics": 6.0, "steps": 3.0, "tree": 1.0, "torques": 2.0, "decisions": 1.0, "set_up": 0.5, "loop": 2.5,
        "closed_loop": 10.0, "metrics": 3.0, "ratio_loop": 1.5, "ratio_with_metrics": 2.0, "ratio_strict": 4.0,
    })  # fmt: skip


REFERENCE = RecordedScenario("2026-01-01", "here", [0, 1], "ww", ["aa", "bb"], *[[None, None]] * 3)
COST = TickCost("2026-01-01", "a test", 2.0, 2.5)


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
    new = TickCost("2026-01-02", "", 2.0, 3.0)
    assert judged("s", REFERENCE, COST, new, "aa", "here").slower == pytest.approx(0.2)
    assert judged("s", REFERENCE, None, new, "aa", "here").slower == 0.0


@pytest.fixture
def recorded(quick, monkeypatch):
    """References of one timed scenario in r.json."""
    monkeypatch.setattr(throughput, "SCENARIOS", ("s.toml",))
    monkeypatch.setattr(throughput, "tick_costs", lambda name: {"ratio_loop": 2.0, "ratio_with_metrics": 2.5})
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
    assert (cost.loop, cost.metrics, cost.reason) == (2.0, 2.5, "a test")

    found.costs["s"] = msgspec.structs.replace(cost, loop=cost.loop / 3.0)
    references.write(path, found)
    assert main(["bench", "regress", *recorded, "--json"]) == 0, "slow is no failure"
    (timed,) = json.loads(capsys.readouterr().out)["scenarios"]
    assert timed["result"] == SAME
    assert timed["slower"] > SLOWER
    assert timed["slower"] == pytest.approx(2.0)

    reference = found.scenarios["s"]
    found.scenarios["s"] = msgspec.structs.replace(reference, digests=["0" * 12, *reference.digests[1:]])
    references.write(path, found)
    assert main(["bench", "regress", *recorded]) == 1
    out = capsys.readouterr().out
    assert CHANGED in out
    assert "slower by" in out
