"""Engines side by side: the numbers, the verdict, the files and the command."""

import dataclasses
import json
import math

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.cli import main as cli
from biped.engines import home
from biped.ensemble.plan import Plan
from biped.scenario.metrics import METRICS
from biped.scenario.reading import read_scenario
from biped.show.figures.curves import overlay
from biped.studies.comparison import DEFAULT, PARTED, compare, parted_at, spread

SHORT = ["duration=1.0", "window.start=0.2", "window.end=1.0"]


@pytest.fixture(scope="module")
def comparison():
    return compare("level_normal_generalized", "level_normal_generalized", SHORT, 1)


def test_what_one_engine_cannot_do_is_said_of_the_engine():
    """Nobody wrote `--set engine=home`; what is wrong anyway is said as ever."""
    with pytest.raises(InputError, match=r"^compare: in the engine 'home': .*seven links"):
        compare("any/h1", "h1", (), 1)
    with pytest.raises(InputError, match=r"^--set: duration: expected a number"):
        compare("level_normal", "level_normal", ("duration=-1",), 1)


def test_spread_is_relative_to_the_largest():
    assert spread([0.8, 0.9, 1.0]) == pytest.approx(0.2)
    assert spread([-2.0, -4.0]) == pytest.approx(0.5)
    assert math.isnan(spread([1e-12, 1e-11]))
    assert math.isnan(spread([math.nan, 1.0]))


def test_every_metric_is_there_from_both_engines_and_the_thesis(comparison):
    metrics = comparison.metrics()
    assert list(metrics) == list(METRICS)
    for name, row in metrics.items():
        for engine in DEFAULT:
            np.testing.assert_equal(row[engine], comparison.results[engine]["summary"][name])
    thesis = comparison.plans["home"].scenario.thesis
    assert metrics["speed"]["thesis"] == thesis["speed"] == 0.81
    assert "thesis" not in metrics["slip"]
    assert metrics["penetration"]["home"] < 1e-8 < metrics["penetration"]["mujoco"]  # it is two engines


def test_walkers_part_when_a_coordinate_differs(comparison):
    here = comparison.first["home"]
    assert math.isnan(parted_at(here, here))
    log = here.log.copy()
    log[300:, 1] += 1.01 * PARTED
    assert parted_at(here, dataclasses.replace(here, log=log)) == pytest.approx(0.3)
    log[300:, 1] = here.log[300:, 1] + 0.99 * PARTED
    assert math.isnan(parted_at(here, dataclasses.replace(here, log=log)))
    # The later of two that end at different times is compared up to the end of the other.
    assert math.isnan(parted_at(here, dataclasses.replace(here, log=here.log[:100])))


def test_who_differs_is_said_with_what_and_when(comparison):
    """Of three engines, two of which are one: the third differs from both."""
    home, mujoco = comparison.results["home"], comparison.results["mujoco"]
    runs = [run | {"speed": 1.2 * run["speed"]} for run in mujoco["runs"]]
    faster = mujoco | {"runs": runs, "summary": mujoco["summary"] | {"speed": runs[0]["speed"]}}
    c = comparison._replace(
        plans={"a": comparison.plans["home"], "b": comparison.plans["home"], "c": comparison.plans["mujoco"]},
        results={"a": home, "b": home, "c": faster},
        first={"a": comparison.first["home"], "b": comparison.first["home"], "c": comparison.first["mujoco"]},
    )
    assert {one.engines for one in c.disagreements()} == {("a", "c"), ("b", "c")}
    assert c.verdict().startswith("differ: c from a and b, in ")
    assert f"speed {METRICS['speed'].text(runs[0]['speed'])} in c" in c.verdict()
    same = c._replace(results={"a": home, "b": home, "c": home})
    assert not same.disagreements()
    assert same.verdict().startswith("agree: ")


def test_ensembles_are_compared_by_their_means():
    changes = [*SHORT, "randomise.runs=3", "start.jitter=0.002"]
    made = compare("level_normal_generalized", "x", changes, 1)
    for engine in DEFAULT:
        runs = made.results[engine]["runs"]
        assert [run["index"] for run in runs] == [0, 1, 2]
    single = home.simulate(Plan(read_scenario("level_normal_generalized", [*changes, "engine=home"])).run(0))
    assert single.log.tobytes() == made.first["home"].log.tobytes()


def test_overlay_draws_both_walkers(comparison):
    axes = overlay(comparison.first, "walk").axes
    assert len(axes) == 4
    for each in axes:
        lines = each.get_lines()
        assert len(lines) == 2
        assert not np.array_equal(lines[0].get_ydata(), lines[1].get_ydata())
    assert [text.get_text() for text in axes[0].get_legend().get_texts()] == list(DEFAULT)
    knee = np.degrees(comparison.first["home"].q[:, 4])
    np.testing.assert_array_equal(axes[2].get_lines()[0].get_ydata(), knee)


def test_command_prints_one_object_and_leaves_figure_recording_and_numbers(tmp_path, capsys):
    out = tmp_path / "both"
    changes = [part for change in SHORT for part in ("--set", change)]
    status = cli.main(["compare", "level_normal_generalized", *changes, "--json", "--out", str(out)])
    printed = json.loads(capsys.readouterr().out)
    assert status == 0
    assert printed == json.loads((out / "comparison.json").read_text())
    assert printed["scenario"] == "level_normal_generalized"
    assert set(printed["results"]) == set(DEFAULT)
    for engine in DEFAULT:
        assert printed["results"][engine]["engine"] == engine
    assert {path.name for path in out.iterdir()} == {
        "comparison.json", "overlay.png", "recording.rrd", "scenario.toml", "strike.png"
    }  # fmt: skip
    assert all(path.stat().st_size > 1000 for path in out.iterdir())


def test_several_scenarios_share_one_table_with_three_columns(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    changes = [part for change in SHORT for part in ("--set", change)]
    names = ["level_normal_generalized", "level_slow_generalized"]
    assert cli.main(["compare", *names, *changes]) == 0
    text = capsys.readouterr().out
    (header,) = [line for line in text.splitlines() if line.startswith("scenario ")]
    assert header.split() == ["scenario", "metric", "thesis", "home", "MuJoCo", "spread", "meaning"]
    for name in names:
        (row,) = [line for line in text.splitlines() if line.startswith(name + " ")]
        assert row.split()[1] == "speed"
        assert float(row.split()[2]) in (0.81, 0.68)
        assert (tmp_path / "runs" / f"compare-{name}").is_dir()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--engine", "home"], "expected --engines"),
        (["--engines", "home"], "at least two engines"),
        (["--engines", "home,hom"], "expected different ones of mujoco, home, drake"),
        (["--against", "ground.friction=1", "--engines", "home,mujoco"], "without --engines"),
        (["level_slow", "--out", "x"], "one scenario only"),
    ],
)
def test_bad_input_is_two(arguments, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["compare", "level_normal", *arguments]) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_joint_torques_for_ground_that_only_pushes_walk_alike_in_both_engines():
    """Where published joint torques walk in one engine and fall in the other, these agree (docs/pushing.md)."""
    changes = ["randomise.runs=3", 'randomise.draw={"start.posture"={grid=["heel_toe","flat","single"]}}']
    made = compare("calm/own", "calm/own", changes, 1)
    for engine in DEFAULT:
        assert made.results[engine]["summary"]["walked"] == 3
    rows = made.metrics()
    assert rows["speed"]["spread"] < 0.01
    assert rows["cost_of_transport"]["spread"] < 0.02
    assert rows["torso_lean"]["spread"] < 0.02
    assert made.verdict().startswith("agree: walked 3 of 3 in home and 3 of 3 in mujoco; speed within 0.")
