"""What people see of a campaign: tables, figures, the report and the recording say what result.json says."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

from matplotlib import image

from biped.cli.main import main
from biped.show.results import causes_of

SWEEP = """
[sweep]
"ground.slope" = [0.0, 2.0]
controller = ["normal", "fast"]
[threshold]
rate = 0.5
[thesis]
speed = 0.81
"""


def is_picture(path: Path) -> bool:
    pixels = image.imread(path)[..., :3]
    return 0.005 < (pixels < 0.9).any(axis=2).mean() < 0.9


def test_terminal(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    assert main(["run", "e.toml", "--out", "shown", "--jobs", "1"]) in (0, 1)
    out = capsys.readouterr().out
    result = json.loads(Path("shown/result.json").read_text(encoding="utf-8"))
    assert f"walked {result['summary']['walked']} of 12" in out
    assert f"fell {result['summary']['falls']}" in out
    for cause, count in causes_of(result["runs"]):
        assert f"{count} × {cause}" in out
    for point in result["points"]:
        assert f"{point['walked']} of {point['runs']}" in out
    assert "0.81" in out, "the thesis's number"


def test_causes_are_counted():
    runs = [
        {"end": "fell", "walked": False, "cause": "fell forward at 0.400 s"},
        {"end": "fell", "walked": False, "cause": "fell forward at 0.700 s"},
        {"end": "completed", "walked": False, "stood": False, "flight": 0.5, "support": 0.4, "time": 10.0},
        {"end": "completed", "walked": True, "cause": ""},
        {"end": "doubtful", "walked": False, "cause": "energy not accounted for at 9.999 s: 3 %, at most 1 %"},
        {"end": "doubtful", "walked": False, "cause": "energy not accounted for at 7.123 s: 4 %, at most 1 %"},
        {"end": "diverged", "walked": False, "cause": "MuJoCo warned of badqacc before 0.024 s; fell at 0.024 s"},
        {"end": "fell", "walked": False, "cause": "fell backward at 0.300 s", "verdict": "doubtful",
         "doubt": "energy from nowhere at 0.300 s: 9 %, at most 5 %"},
    ]  # fmt: skip
    assert causes_of(runs) == [
        ("fell forward", 2), ("stayed up; doubtful: energy not accounted for", 2),
        ("stayed up without walking: in the air", 1), ("diverged: MuJoCo warned of badqacc", 1),
        ("fell backward; doubtful: energy from nowhere", 1),
    ]  # fmt: skip


def test_plot(result, capsys):
    assert main(["plot", "c"]) == 0
    drawn = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert [path.stem for path in drawn] == ["rates", "costs", "failures", "velocities"]
    assert all(is_picture(path) for path in drawn)


def test_rates_are_those_of_the_points(result):
    from biped.show.figures import rate_map, rates

    bars = rates(result["points"], "c").axes[0].patches
    by_slope = sorted(result["points"], key=lambda point: point["values"]["ground.slope"])
    assert [bar.get_height() for bar in bars] == [point["rate"] for point in by_slope]
    grid = rate_map(result["points"], "c").axes[0].images[0].get_array()
    assert grid.ravel().tolist() == [point["rate"] for point in by_slope]


def test_report(result, capsys):
    assert main(["report", "c", "--out", "r.md", "--title", "What came"]) == 0
    text = Path("r.md").read_text(encoding="utf-8")
    assert text.startswith("# What came\n")
    assert f"walked {result['summary']['walked']} of 12" in text
    for point in result["points"]:
        assert f"| {point['values']['controller']} | {point['walked']} of {point['runs']} |" in text
    for name in ("rates", "costs", "failures", "velocities"):
        assert f"](r/c/{name}.png)" in text
        assert is_picture(Path(f"r/c/{name}.png"))


def test_words_of_a_stranger_are_text_in_a_report(result, tmp_path):
    hostile = r"![x](http://e.example/p.png) <img src=x> `a` | $\bad c" + "\x1b[31m"
    shutil.copytree("c", tmp_path / "c")
    told = result | {
        "scenario": hostile,
        "checks": [{"name": "speed", "value": 1.0, "expected": hostile, "passed": True}],
    }
    told["runs"] = [run | ({"cause": hostile} if run["fell"] else {}) for run in told["runs"]]
    told["points"] = [point | {"values": point["values"] | {"controller": hostile}} for point in told["points"]]
    (tmp_path / "c/result.json").write_text(json.dumps(told), encoding="utf-8")
    scenario = tmp_path / "c/scenario.toml"
    text = scenario.read_text(encoding="utf-8")
    line = next(line for line in text.splitlines() if line.startswith("description"))
    scenario.write_text(text.replace(line, f"description = {json.dumps(hostile)}"), encoding="utf-8")
    assert main(["report", str(tmp_path / "c"), "--out", "h.md", "--title", hostile]) == 0
    page = Path("h.md").read_text(encoding="utf-8")
    assert "http://e.example" in page
    code = re.sub(r"`[^`\n]*`", "", page)  # between backticks all is text
    assert "![x" not in code
    assert "<img" not in code.replace(r"\<img", "")
    assert all(line.isprintable() for line in page.splitlines())


def test_a_report_names_the_command_that_repeats_the_runs(folder, monkeypatch):
    monkeypatch.chdir(folder)
    short = ["--set", "duration=0.3", "--set", "window.start=0.1", "--set", "window.end=0.3"]
    assert main(["run", "level_fast", *short, "--set", "controller=robust", "--out", "changed"]) in (0, 1)
    assert main(["run", "e.toml", "--only", "0", "--out", "alone"]) in (0, 1)
    assert main(["report", "changed", "alone", "--out", "commands.md"]) == 0
    commands = [line.split("`")[1] for line in Path("commands.md").read_text(encoding="utf-8").splitlines()
                if line.startswith("`biped run")]  # fmt: skip
    assert commands == ["biped run changed/scenario.toml", "biped run alone/scenario.toml --only 0"]
    for line, out in zip(commands, ("again", "again-alone"), strict=True):
        assert main([*line.split()[1:], "--out", out]) in (0, 1)
        before = json.loads(Path(line.split()[2]).with_name("result.json").read_text(encoding="utf-8"))
        assert json.loads(Path(out, "result.json").read_text(encoding="utf-8"))["runs"] == before["runs"]
    changed = json.loads(Path("changed/result.json").read_text(encoding="utf-8"))
    assert changed["thesis"] == {}, "the thesis's fast gait was not walked"


def test_a_scenario_of_a_name_is_repeated_by_it():
    from biped.scenario.reading import read_scenario
    from biped.show.replay import _command
    from biped.studies.run import plan_of

    named = {"scenario": "level_fast", "runs": [{"index": 0}]}
    assert _command(Path("x"), named, plan_of("level_fast", []).scenario) == "biped run level_fast"
    other = read_scenario("level_fast", ["seed=5"])
    assert _command(Path("x"), named, other) == "biped run x/scenario.toml"


def test_velocities_are_drawn_of_all_runs_evenly():
    from biped.show.replay import spread

    rows = [{"index": number} for number in range(180)]
    drawn = spread(rows, 100)
    assert len(drawn) == len(set(drawn)) == 100
    assert drawn[-1] >= 178
    assert spread(rows[:7], 100) == list(range(7))


def test_velocities_make_few_runs_again_and_say_how_many(result, monkeypatch):
    from biped.ensemble import campaign
    from biped.show import figures, replay

    titles, made = [], []
    simulate = campaign.simulate
    monkeypatch.setattr(campaign, "simulate", lambda run: made.append(run.index) or simulate(run))
    monkeypatch.setattr(replay, "DRAWN", 2)
    monkeypatch.setattr(replay, "FELL", 3)
    monkeypatch.setattr(
        figures, "plot_ensemble", lambda drawn, path, title: titles.append(([t.end for t in drawn], title))
    )
    replay.plot_results(Path("c"), Path("few"))
    ((ends, title),) = titles
    stood = sum(run["end"] == "completed" for run in result["runs"])
    assert ends.count("completed") == len(made) == min(2, stood)
    assert ends.count("fell") == min(3, 12 - stood)  # from what was kept
    assert title.startswith(f"e: {result['summary']['walked']} of 12 walked (")
    assert f"last seconds of {min(3, 12 - stood)} others" in title
