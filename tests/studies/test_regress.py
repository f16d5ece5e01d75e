"""The guard notices what changed, and records nothing without a reason."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest

from biped.base.statistics import same_rate
from biped.cli.main import main
from biped.ensemble import journal
from biped.ensemble.campaign import run_one
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from biped.show.references import document_of, moved_table
from biped.show.terminal import show
from biped.studies.regress import ScenarioOutcome, references, regress
from biped.studies.regress.references import (
    DIGITS,
    MOST,
    PHYSICS,
    RUNS,
    SAME,
    SECONDS,
    Moved,
    RecordedScenario,
    ScenarioComparison,
    altogether,
    chosen,
    compare,
    digest,
    ensemble,
)
from biped.studies.run import plan_of
from tests.cases import SHORT, command, write


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def record(*more: str) -> int:
    return main(["regress", "s.toml", "--file", "r.json", "--jobs", "1", "--update", "--reason", "a test", *more])


def edited(**changes) -> None:
    """Changes the reference of s.toml on disk."""
    path = Path("r.json")
    found = references.read(path)
    found.scenarios["s"] = msgspec.structs.replace(found.scenarios["s"], **changes)
    references.write(path, found)


def check(capsys, *argv: str) -> tuple[int, dict]:
    return command(capsys, "regress", "s.toml", "--file", "r.json", "--jobs", "1", *argv)


def test_recorded_then_the_same_for_any_number_of_jobs(capsys):
    write("s.toml", SHORT)
    assert record() == 0
    there = Path("r.json").read_bytes()
    for jobs in "12":
        code, result = check(capsys, "--jobs", jobs)
        assert code == 0
        (verdict,) = result["verdicts"]
        assert (verdict["verdict"], verdict["identical"], verdict["exact"]) == (SAME, MOST, True)
    assert Path("r.json").read_bytes() == there


def test_a_perturbed_run_is_detected(capsys):
    """A billionth of a radian per second in one start changes the digits and is told from what was recorded."""
    write("s.toml", SHORT)
    record()
    write("s.toml", SHORT + "v = [0.0, 0.0, 0.0, 1e-9, 0.0, 0.0, 0.0, 0.0, 0.0]\n")
    code, result = check(capsys)
    assert code == 1
    (verdict,) = result["verdicts"]
    assert (verdict["verdict"], verdict["identical"]) == (DIGITS, 0)
    assert Path("r.json").read_text(encoding="utf-8").count("a test") == 1


def test_another_gait_is_another_physics(capsys):
    text = SHORT.replace("0.5", "4.0") + "settle = false\n"
    write("s.toml", text)
    record()
    write("s.toml", text + "[actuation]\ntorque_limit = 20.0\n")
    code, result = check(capsys)
    assert code == 1
    (verdict,) = result["verdicts"]
    assert verdict["verdict"] == PHYSICS
    assert verdict["walked"][0] > verdict["walked"][1] == 0
    assert verdict["likely"] < 1e-3


def test_a_changed_metric_of_the_same_trajectory_is_detected(capsys):
    write("s.toml", SHORT)
    record()
    speeds = references.read(Path("r.json")).scenarios["s"].speed
    edited(speed=[0.5 if value is None else value + 1e-4 for value in speeds])
    code, result = check(capsys)
    assert code == 1
    assert result["verdicts"][0]["identical"] == MOST
    assert result["verdicts"][0]["verdict"] != SAME


def test_on_another_platform_digits_may_differ(capsys):
    write("s.toml", SHORT)
    record()
    edited(platform="elsewhere", digests=["0" * 12] * MOST)
    code, result = check(capsys)
    assert code == 0
    assert (result["verdicts"][0]["verdict"], result["verdicts"][0]["exact"]) == (DIGITS, False)
    assert main(["regress", "s.toml", "--file", "r.json", "--jobs", "1"]) == 0
    assert "another platform" in capsys.readouterr().out


def test_update_keeps_the_history_and_touches_only_what_changed(capsys):
    write("s.toml", SHORT)
    write("t.toml", SHORT.replace("heel_toe", "flat"))
    both = ["regress", "s.toml", "t.toml", "--file", "r.json", "--jobs", "1", "--update", "--reason"]
    assert main([*both, "first"]) == 0
    edited(digests=["0" * 12] * MOST)
    assert main([*both, "second"]) == 0
    out = capsys.readouterr().out
    assert "digits changed" in out
    found = references.read(Path("r.json"))
    assert [(change.reason, change.scenarios) for change in found.history] == [("second", ["s"]), ("first", ["s", "t"])]
    assert set(found.platforms) == {journal.key(journal.here())}
    assert main([*both, "third"]) == 0
    assert len(references.read(Path("r.json")).history) == 2, "nothing had changed"


def test_without_a_reference_it_fails_and_says_how_to_record(capsys):
    write("s.toml", SHORT)
    assert main(["regress", "s.toml", "--file", "r.json", "--jobs", "1"]) == 1
    out = capsys.readouterr().out
    assert "no reference" in out
    assert "--update --reason" in out
    assert not Path("r.json").exists()


def test_interrupted_update_keeps_what_was_finished(monkeypatch, capsys):
    from biped.studies.regress import references as module

    write("s.toml", SHORT)
    write("t.toml", SHORT)
    made = module.measured

    def interrupted(plan: Plan, *rest) -> RecordedScenario:
        if references.read(Path("r.json")).scenarios:
            raise KeyboardInterrupt
        return made(plan, *rest)

    monkeypatch.setattr(module, "measured", interrupted)
    argv = ["regress", "s.toml", "t.toml", "--file", "r.json", "--jobs", "1", "--update", "--reason", "a test"]
    assert main(argv) == 130
    assert "stopped" in capsys.readouterr().err
    assert list(references.read(Path("r.json")).scenarios) == ["s"]


def test_all_scenarios_means_no_reference_without_one(monkeypatch):
    """A reference whose scenario is no more fails, and an update removes it."""
    from biped.studies import regress as module

    write("s.toml", SHORT)
    monkeypatch.setattr(module, "names", lambda kind: ["s.toml"])
    file = Path("r.json")
    assert regress([], 1, file, "first").passed
    found = references.read(file)
    assert found.history[0].scenarios == ["all"]
    found.scenarios["old"] = found.scenarios["s"]
    references.write(file, found)
    outcome = regress([], 1, file, None)
    assert not outcome.passed
    assert [(v.scenario, v.verdict) for v in outcome.verdicts] == [("s", SAME), ("old", "gone")]
    assert regress([], 1, file, "removed").passed
    assert list(references.read(file).scenarios) == ["s"]


def test_the_first_run_is_the_scenario_itself():
    for name in ("level_fast", "robust/own", "tune/robust"):
        plan = plan_of(name, ["duration=0.2", "window.start=0.1", "window.end=0.2"])
        assert len(plan) == 1
        many = ensemble(plan)
        assert len(many) == MOST
        trajectories = [run_one(p, 0)[0] for p in (plan, many)]
        assert digest(trajectories[0]) == digest(trajectories[1])
        assert digest(run_one(many, 1)[0]) != digest(trajectories[0])


@pytest.mark.parametrize("name", ["thesis/push_map", "thesis/level", "thesis/model_error", "robust/long", "ci/slope"])
def test_runs_are_distinct_and_spread_over_all_points(name):
    plan = Plan(read_scenario(name))
    runs = chosen(plan)
    points = {run // plan.scenario.randomise.runs for run in runs}
    assert len(set(runs)) == len(runs)
    assert len(points) == min(len(plan.points), len(runs))
    assert all(0 <= run < len(plan) for run in runs)
    assert plan.scenario.duration * len(runs) <= SECONDS


def test_every_shipped_scenario_has_a_reference_of_the_runs_made_of_it():
    from biped.base.files import names

    found = references.read(references.shipped())
    assert set(found.scenarios) == set(names("scenarios"))
    for name, reference in found.scenarios.items():
        assert reference.runs == chosen(ensemble(plan_of(name, ()))), name
        assert reference.platform in found.platforms
    assert all(change.reason and change.date for change in found.history)


def reference(ends: str = "w" * 12, speed: float | list[float] = 0.8, **more) -> RecordedScenario:
    n = len(ends)
    speeds = [speed] * n if isinstance(speed, float) else speed
    values = [value if end == "w" else None for value, end in zip(speeds, ends, strict=True)]
    made = RecordedScenario("2026-01-01", "here", list(range(n)), ends, ["d"] * n, values, values, values)
    return msgspec.structs.replace(made, **more)


def test_tolerances():
    old = reference()
    within = compare("s", old, reference(speed=0.8 * 1.01, digests=["e"] * 12))
    beyond = compare("s", old, reference(speed=0.8 * 1.03, digests=["e"] * 12))
    assert (within.verdict, beyond.verdict) == (DIGITS, PHYSICS)
    assert not within.passed, "the same platform: digits count"
    assert compare("s", old, reference(speed=0.8 * 1.01, platform="there")).passed
    assert not compare("s", old, reference(speed=0.8 * 1.03, platform="there")).passed


def test_chance_explains_a_change_that_scatters():
    """One mean 10 % off: with a scatter of 20 % from run to run it is nothing, with one of 1 % it is a change."""
    old = reference()
    for scatter, verdict in ((0.2, DIGITS), (0.01, PHYSICS)):
        speeds = [0.8 * (1.1 + scatter * (-1) ** i) for i in range(12)]
        assert compare("s", old, reference(speed=speeds, digests=["e"] * 12)).verdict == verdict


def test_a_mean_is_over_runs_that_walked_both_times():
    moved = compare("s", reference("wwwwwwff"), reference("wwwwwfww", digests=["e"] * 8))
    assert (moved.walked, moved.fell) == ((6, 7), (2, 1))
    assert moved.metrics["speed"].old == pytest.approx(0.8)
    assert compare("s", reference("wwffff"), reference("wwffff", speed=9.0)).metrics == {}


def test_other_runs_are_no_comparison():
    verdict = compare("s", reference(), reference("w" * 11))
    assert (verdict.verdict, verdict.passed) == (RUNS, False)


def test_what_no_scenario_shows_shows_in_all_of_them():
    """Each of ten scenarios loses 3 of 12 walkers on another platform: unremarkable one by one, not together."""
    each = [compare(str(i), reference(), reference("w" * 9 + "fff", platform="there")) for i in range(10)]
    assert all(verdict.passed for verdict in each)
    assert altogether(each).verdict == PHYSICS
    slower = [compare(str(i), reference(), reference(speed=0.8 * 0.985, platform="there")) for i in range(10)]
    assert all(verdict.passed for verdict in slower)
    assert not altogether(slower).passed


@pytest.mark.parametrize("counts", [(12, 4, 12, 12), (3, 1, 4, 4), (0, 0, 5, 5), (7, 2, 20, 9), (400, 350, 500, 500)])
def test_same_rate_is_fishers_test(counts):
    from scipy.stats import fisher_exact

    first, second, trials, other = counts
    expected = fisher_exact([[first, trials - first], [second, other - second]]).pvalue
    assert same_rate(*counts) == pytest.approx(expected, rel=1e-9)


def test_the_file_is_readable_line_by_line():
    write("s.toml", SHORT)
    record()
    text = Path("r.json").read_text(encoding="utf-8")
    assert json.loads(text)["scenarios"]["s"]["ends"]
    assert max(len(line) for line in text.splitlines()) < 400
    assert sum('"speed": [' in line for line in text.splitlines()) == 1


def test_then_now_and_difference_are_shown(capsys):
    """Then, now and the difference of what moved; what did not is one number."""
    moved = compare("s", reference(), reference(speed=0.9, digests=["e"] * 12))
    show(document_of(ScenarioOutcome([moved], {}, False, [], False).as_dict()))
    out = capsys.readouterr().out
    assert "0.8 → 0.9 (+12.5%)" in out
    assert "CHANGED" in out
    assert "0 of 12" in out
    show(document_of(ScenarioOutcome([compare("s", reference(), reference())], {}, False, [], False).as_dict()))
    assert "→" not in capsys.readouterr().out


def test_what_moved_is_a_table_sorted_by_its_cause():
    still = {"speed": Moved(1.0, 1.0, 0.0, within=True)}
    moved = {
        "speed": Moved(1.0, 1.1, 0.1, within=False),
        "double_support": Moved(0.25, 0.2, -0.2, within=False),
    }
    verdicts = [
        ScenarioComparison("b", PHYSICS, 12, 12, (9, 8), (0, 0), 1.0, moved, exact=True, passed=False),
        ScenarioComparison("a", SAME, 12, 12, (9, 9), (0, 0), 1.0, still, exact=True, passed=True),
    ]
    table = moved_table(ScenarioOutcome(verdicts, {}, False, [], False))
    assert "| b | 25 % | 20 % | 12 of 12 |" in table
    assert "| b | 9 | 8 | 12 of 12 |" in table
    assert "| a |" not in table
    assert table.index("### double support") < table.index("### walked") < table.index("### speed: no cause is known")
    assert moved_table(ScenarioOutcome(verdicts[1:], {}, False, [], False)) == "No reference moved.\n"
