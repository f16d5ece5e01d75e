"""Two results compared: pairs, verdicts, what is said and what the exit code is."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.files import locate
from biped.base.writing import dumps
from biped.cli.main import main
from biped.ensemble.plan import Plan
from biped.ensemble.results import result_of
from biped.ensemble.rows import LOST, Row
from biped.scenario.keys import Scenario
from biped.scenario.metrics import METRICS
from biped.scenario.randomise import Randomise
from biped.scenario.reading import to_toml
from biped.scenario.vary import run_seed
from biped.studies.diff import of_folders
from tests.cases import SHORT, command, write

N = 40


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def rows(seed: int = 0, n: int = N, **changed) -> list[Row]:
    """Walking rows with scattered numbers; a keyword gives values of a field, by run."""
    rng = np.random.default_rng(11)
    scatter = rng.standard_normal((n, 3))
    made = []
    for i in range(n):
        fields = {
            "index": i, "seed": run_seed(seed, i), "values": {}, "fell": False, "end": "completed", "cause": "",
            "walked": True, "stood": 0, "time": 10.0, "speed": 0.7 + 0.05 * scatter[i, 0],
            "cost_of_transport": 0.2 + 0.02 * scatter[i, 1], "step_length": 0.6 + 0.05 * scatter[i, 2],
            "support": 1.0, "flight": 0.0, "alternation": 1.0,
        }  # fmt: skip
        made.append(Row(**(fields | {name: value[i] for name, value in changed.items()})))
    return made


def fallen(of: list[Row], which: range) -> list[Row]:
    end = {"walked": False, "fell": True, "end": "fell", "cause": "fell forward at 3.000 s", "time": 3.0}
    nothing = {"speed": math.nan, "cost_of_transport": math.nan, "step_length": math.nan}
    return [Row(**{**row.as_dict(), **end, **nothing}) if row.index in which else row for row in of]


def save(name: str, made: list[Row], scenario: Scenario | None = None) -> Path:
    plan = Plan(scenario or Scenario(randomise=Randomise(runs=len(made))))
    where = Path(name)
    where.mkdir()
    (where / "result.json").write_text(dumps(result_of(name, plan, made)))
    (where / "scenario.toml").write_text(to_toml(plan.scenario))
    return where


def verdicts(first: list[Row], second: list[Row], **settings) -> dict[str, str]:
    found = of_folders(save("a", first), save("b", second), **settings)
    return {change.name: change.verdict for change in found.changes}


def column(made: list[Row], name: str, factor: float, noise: float = 0.0) -> list[float]:
    rng = np.random.default_rng(5)
    return [getattr(row, name) * factor * (1.0 + noise * rng.standard_normal()) for row in made]


def test_the_same_runs_are_the_same_to_the_last_digit():
    found = of_folders(save("a", rows(n=3)), save("b", rows(n=3)))
    assert found.identical
    assert found.passed
    assert {change.verdict for change in found.changes} == {"same"}
    assert not found.settings


def test_more_cost_is_worse_and_less_is_better():
    base = rows()
    dearer = verdicts(base, rows(cost_of_transport=column(base, "cost_of_transport", 1.2, 0.05)))
    assert dearer["cost_of_transport"] == "worse"
    assert dearer["speed"] == "same"
    found = of_folders(Path("b"), Path("a"))
    assert {c.name: c.verdict for c in found.changes}["cost_of_transport"] == "better"
    assert found.passed


def test_a_change_of_what_has_no_better_is_changed():
    base = rows()
    got = verdicts(base, rows(step_length=column(base, "step_length", 1.3, 0.02)))
    assert METRICS["step_length"].better == "neither"
    assert got["step_length"] == "changed"
    assert "worse" not in got.values()


def test_a_change_that_does_not_matter_is_the_same_however_sure():
    base = rows()
    second = rows(cost_of_transport=column(base, "cost_of_transport", 1.02))
    assert verdicts(base, second)["cost_of_transport"] == "same"
    strict = of_folders(Path("a"), Path("b"), margin=0.01)
    (cost,) = (c for c in strict.changes if c.name == "cost_of_transport")
    assert cost.verdict == "worse"
    assert cost.estimate.low > 0.0


def test_noise_says_nothing():
    rng = np.random.default_rng(8)
    got = verdicts(rows(), rows(cost_of_transport=list(0.2 + 0.1 * rng.standard_normal(N))))
    assert got["cost_of_transport"] == "cannot say"


def test_five_falls_say_nothing_and_twelve_do():
    assert verdicts(rows(), fallen(rows(), range(5)))["walked"] == "cannot say"
    found = of_folders(Path("a"), save("c", fallen(rows(), range(12))))
    assert set(found.worse) == {"walked", "falls"}
    assert not found.passed
    assert [run["index"] for run in found.lost] == list(range(12))
    walked = next(c for c in found.changes if c.name == "walked")
    assert (walked.first, walked.second, walked.pairs) == (40, 28, 40)
    assert walked.estimate.change == pytest.approx(-0.3)
    speed = next(c for c in found.changes if c.name == "speed")
    assert speed.pairs == 28  # those in which both walked


def test_only_the_headline_decides_and_its_questions_alone_count():
    """8 of 8: p = 0.0078; times the questions of the headline that can be asked."""
    first, second = rows(), fallen(rows(), range(8))
    assert verdicts(first, second, only=["walked"]) == {"walked": "worse"}
    many = of_folders(Path("a"), Path("b"))
    walked = next(c for c in many.changes if c.name == "walked")
    assert walked.estimate.p == pytest.approx(2 / 2**8)
    asked = sum(1 for c in many.deciding if not math.isnan(c.adjusted))
    assert asked == 4
    assert walked.adjusted == pytest.approx(asked * 2 / 2**8)
    assert walked.verdict == "worse"
    assert [c.name for c in many.deciding] == ["walked", "falls", "speed", "cost_of_transport"]


def test_a_detail_that_became_worse_fails_nothing():
    base = rows()
    found = of_folders(save("a", base), save("b", rows(support=[0.5] * N)))
    worse = {c.name for c in found.changes if c.verdict == "worse"}
    assert worse.isdisjoint(found.headline)
    assert found.passed
    assert of_folders(Path("a"), Path("b"), only=["step_length"]).headline == ("step_length",)


def test_pairs_are_runs_of_the_same_seed():
    shuffled = [Row(**{**row.as_dict(), "index": N - 1 - row.index}) for row in rows()]
    found = of_folders(save("a", rows()), save("b", sorted(shuffled, key=lambda row: row.index)))
    assert len(found.pairs) == N
    speed = next(c for c in found.changes if c.name == "speed")
    assert speed.verdict == "same"
    assert speed.estimate.change == speed.estimate.high == 0.0


def test_runs_without_a_partner_and_lost_ones_are_left_out():
    lost = [Row(**{**row.as_dict(), "end": LOST, "walked": False}) if row.index < 4 else row for row in rows(n=50)]
    found = of_folders(save("a", rows()), save("b", lost))
    assert len(found.pairs) == 36


def test_other_seeds_are_refused():
    save("a", rows())
    save("b", rows(seed=1))
    with pytest.raises(InputError, match="no run in common"):
        of_folders(Path("a"), Path("b"))


def test_points_of_a_sweep_are_paired_point_by_point():
    s = Scenario(randomise=Randomise(runs=20), sweep={"ground.slope": (0.0, 2.0)})

    def swept(rows_: list[Row]) -> list[Row]:
        half = [Row(**{**r.as_dict(), "values": {"ground.slope": 0.0}}) for r in rows_[:20]]
        other = [
            Row(**{**r.as_dict(), "values": {"ground.slope": 2.0}, "index": r.index + 20}) for r in rows_[:20]
        ]  # fmt: skip
        return [*half, *fallen(other, range(20, 27))]

    a = save("a", [Row(**{**r.as_dict()}) for r in swept(rows())], s)
    second = [r if r.index < 20 else Row(**{**rows()[r.index - 20].as_dict(), "index": r.index, "values": r.values})
              for r in swept(rows())]  # fmt: skip
    found = of_folders(a, save("b", second, s))
    assert [(p.values, p.pairs, p.first, p.second) for p in found.points] == [
        ({"ground.slope": 0.0}, 20, 20, 20),
        ({"ground.slope": 2.0}, 20, 13, 20),
    ]
    plain = save("c", rows())
    with pytest.raises(InputError, match=r"ground\.slope"):
        of_folders(a, plain)


def test_settings_that_differ_are_named():
    s = Scenario(randomise=Randomise(runs=N), duration=12.0)
    found = of_folders(save("a", rows()), save("b", rows(), s))
    assert ("duration", 10.0, 12.0) in found.settings


def test_nothing_but_falls_can_be_compared():
    """Nobody walks in the second: means have no pairs, counts say it all."""
    got = verdicts(rows(), fallen(rows(), range(N)))
    assert got["speed"] == "cannot say"
    assert got["walked"] == got["falls"] == "worse"


def test_the_worst_run_is_named_with_its_command():
    found = of_folders(save("a", rows()), save("b", fallen(rows(), range(7, 20))))
    worst = found.worst_as_dict()
    assert worst is not None
    assert worst["index"] == 7
    assert worst["again"] == "biped run b/scenario.toml --only 7"


def test_the_command_says_it_all(capsys):
    save("a", rows())
    save("b", fallen(rows(), range(15)))
    code, said = command(capsys, "diff", "a", "b", "--out", "page")
    assert code == 1
    assert said["worse"] == ["walked", "falls"]
    assert said["metrics"]["walked"]["verdict"] == "worse"
    assert said == json.loads(Path("page/diff.json").read_text())
    page = Path("page/diff.md").read_text()
    assert "WORSE: walked worse, falls worse, speed same" in page
    assert "run 0 of the second" in page
    assert main(["diff", "b", "a"]) == 0
    assert "better" in capsys.readouterr().out
    assert main(["diff", "a", "b", "--metrics", "speed"]) == 0


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["a", "a"], "same folder"),
        (["a", "nothing"], "expected a results folder"),
        (["a", "b", "--metrics", "sped"], "did you mean 'speed'"),
        (["a", "b", "--margin", "2"], "--margin 2"),
        (["a", "b", "--scenario", "level_fast"], "--scenario"),
        (["normal", "robust"], "--scenario missing"),
        (["normal", "robst", "--scenario", "level_fast"], "did you mean 'robust'"),
        (["normal", "normal", "--scenario", "level_fast"], "expected two"),
        (["normal", "."], "got another folder"),
    ],
)
def test_bad_input_is_one_paragraph(capsys, argv, words):
    save("a", rows(n=6))
    save("b", rows(n=6))
    assert main(["diff", *argv]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert not Path("runs").exists()


def test_somebody_elses_names_are_only_text(capsys):
    a, b = save("a", rows(n=6)), save("b", rows(n=6, speed=[0.5] * 6))
    result = json.loads((b / "result.json").read_text())
    result["scenario"] = "[red]x[/red] ![p](http://e)\x1b[2J"
    (b / "result.json").write_text(json.dumps(result))
    main(["diff", str(a), str(b), "--out", "page"])
    shown = capsys.readouterr().out
    assert "\x1b[2J" not in shown
    page = Path("page/diff.md").read_text()
    assert "![p]" not in page
    assert "\x1b" not in page


def test_gaits_are_run_with_the_same_seeds(capsys):
    text = SHORT + "[start]\nposture='heel_toe'\njitter=0.002\n[randomise]\nruns = 6\n[window]\nstart=0.1\n"
    write("s.toml", text.replace('[start]\nposture = "heel_toe"\n', "", 1))
    code, said = command(capsys, "diff", "normal", "slow", "--scenario", "s.toml", "--jobs", "1", "--out", "d")
    assert code in (0, 1)
    assert said["pairs"] == 6
    assert not said["identical"]
    assert {"key": "controller", "first": "normal", "second": "slow"} in said["settings"]
    for which, gait in (("first", "normal"), ("second", "slow")):
        assert f'controller = "{gait}"' in Path("d", which, "scenario.toml").read_text()
    again, told = command(capsys, "diff", "d/first", "d/second")
    assert again == code
    assert told["metrics"] == said["metrics"]


def test_a_policys_card_takes_the_place_of_a_gait(capsys):
    """Scenarios of gaits have keys that no policy reads; they are left out for it, and kept for the gait."""
    pytest.importorskip("onnxruntime")
    card = str(locate("controllers", "policy/h1.toml", "card"))
    sets = [f"--set={change}" for change in ("model=h1", "duration=0.3", "window.start=0.1", "randomise.runs=2")]
    argv = ("diff", "any/h1", card, "--scenario", "any/cells/level", *sets, "--jobs", "1", "--out", "d")
    code, said = command(capsys, *argv)
    assert code in (0, 1)
    assert said["pairs"] == 2
    assert {"key": "law", "first": "thesis", "second": card} in said["settings"]
    texts = [Path("d", which, "scenario.toml").read_text() for which in ("first", "second")]
    assert all("jitter = 0.02" in text for text in texts)


def test_pairs_are_made_until_it_is_decided(capsys):
    text = SHORT + "[randomise]\nruns = 6\n"
    write("s.toml", text)
    argv = ("diff", "normal", "slow", "--scenario", "s.toml", "--jobs", "1", "--out", "d", "--sequential")
    code, said = command(capsys, *argv, "--most", "20")
    test = said["sequential"]
    assert code in (0, 1)
    assert test["pairs"] <= said["pairs"] == 20
    assert said["metrics"]["walked"]["verdict"] == test["decision"]
    assert [run["index"] for run in json.loads(Path("d/first/result.json").read_text())["runs"]] == list(range(20))
    assert main(["diff", "normal", "slow", "--scenario", "s.toml", "--sequential", "--ratio", "1"]) == 2
    assert "--ratio 1: expected more than 1" in capsys.readouterr().err
