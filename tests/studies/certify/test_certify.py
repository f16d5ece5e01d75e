"""`biped certify` on walkers: the random force, the score of real runs, the journal, the command and its errors."""

from __future__ import annotations

import json

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.cli.main import main
from biped.ensemble.campaign import simulate
from biped.scenario.randomise import Move, Normals
from biped.scenario.vary import piece_times
from biped.studies.certify import certify, check_random
from biped.studies.certify.estimation import Accuracy
from biped.studies.certify.outcome import SCORES, outcome_of
from biped.studies.run import plan_of

FORCE = "disturbance={force=[120.0,0.0],correlation=0.2}"


def test_the_random_force_has_the_strength_and_the_correlation_asked_for():
    plan = plan_of("upright/own", [FORCE, "duration=40"])
    pushes = [plan.run_from(seed).scenario.push for seed in range(40)]
    force = np.array([[push.force[0] for push in run] for run in pushes])
    apart = pushes[0][1].at - pushes[0][0].at
    assert apart == pytest.approx(0.02)
    assert {push.force[1] for push in pushes[0]} == {0.0}
    assert np.sqrt((force**2).mean()) == pytest.approx(120.0, rel=0.05)
    lag = 10  # pieces: a correlation time
    correlation = (force[:, lag:] * force[:, :-lag]).mean() / (force**2).mean()
    assert correlation == pytest.approx(np.exp(-1.0), abs=0.06)
    assert pushes[0][-1].at + pushes[0][-1].duration == pytest.approx(40.0)


def test_twice_the_force_is_the_same_force_twice():
    one, two = (
        plan_of("upright/own", [f"disturbance={{force=[{size},1.0]}}"]).run_from(3).scenario.push
        for size in (10.0, 20.0)
    )
    assert np.allclose([2.0 * push.force[0] for push in one], [push.force[0] for push in two], rtol=1e-12)


def test_a_branch_is_the_same_run_to_the_last_bit_until_it_begins():
    plan = plan_of("upright/own", [FORCE, "duration=1.0"])
    after = float(piece_times(plan.scenario)[25])
    first = simulate(plan.run_from(Normals(5)))
    branch = simulate(plan.run_from(Normals(5).moved(Move(seed=6, after=after))))
    row = round(after / first.tick)
    assert (first.log[:row, : first.width] == branch.log[:row, : first.width]).all()
    assert (first.q[row + 20] != branch.q[row + 20]).any()


@pytest.mark.parametrize("score", SCORES)
def test_scores_of_a_fall_rise_to_its_end(score):
    plan = plan_of("upright/own", ["push=[{at=0.5,duration=0.3,force=[400.0,0.0]}]", "duration=3"])
    trajectory = simulate(plan.run(0))
    outcome = outcome_of(trajectory, score, 3.0)
    assert outcome.fell
    assert outcome.end == pytest.approx(trajectory.time[-1])
    highest = max(outcome.rises, key=lambda rise: rise[2])
    assert highest[0] > 0.8
    assert highest[2] > 0.1


def test_an_interrupted_command_goes_on_where_it_was(tmp_path):
    changes = [FORCE, "duration=0.4"]
    accuracy = Accuracy(most=260, method="counting")
    whole = certify("upright/own", changes, 1, tmp_path / "whole", accuracy)
    journal = (tmp_path / "whole" / "runs.jsonl").read_bytes().splitlines(keepends=True)
    cut = tmp_path / "cut"
    certify("upright/own", changes, 1, cut, Accuracy(most=200, method="counting"))
    (cut / "certify.json").unlink()
    (cut / "runs.jsonl").write_bytes(b"".join(journal[:150]))
    again = certify("upright/own", changes, 1, cut, accuracy)
    assert again.probability == whole.probability
    assert (cut / "runs.jsonl").read_bytes() == b"".join(journal)
    with pytest.raises(InputError, match="begun with size = 100, score = learned"):
        certify("upright/own", changes, 1, cut, accuracy._replace(score="lean"))


def test_the_command_prints_and_writes_the_probability(tmp_path, capsys):
    out = tmp_path / "out"
    args = ["certify", "upright/own", "--set", FORCE, "--set", "duration=0.3", "--most", "200", "--out", str(out)]
    code = main([*args, "--jobs", "1", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert code == (0 if found["reached"] else 3)
    assert found["method"] == "counting" or found["doubt"]
    assert found["plain"]["runs"] == found["runs"] == 200
    assert json.loads((out / "certify.json").read_text()) == found
    assert "mean steps to a fall" in (out / "certify.md").read_text()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["--set", "start.jitter=0"], "nothing random in this scenario"),
        (["--set", 'sweep={"ground.slope"=[0.0,1.0]}'], "sweep: expected none"),
        (["--set", 'randomise.draw={"ground.slope"={grid=[0.0,1.0]}}'], "expected choice, which is random"),
        (["--most", "50"], "too few runs"),
        (["--score", "marign"], "did you mean 'margin'"),
        (["--relative", "0"], "--relative 0"),
        (["--size", "3"], "--size 3"),
        (["--set", "disturbance={force=[1.0,0.0],body='tors'}"], "disturbance.body"),
        (["--set", "disturbance={force=[1.0,0.0,0.0]}"], "disturbance.force"),
        (["--set", "disturbance={force=[1.0,0.0],at=99}"], "disturbance.at"),
    ],
)
def test_what_cannot_be_certified_is_refused_in_one_sentence(changes, words, tmp_path, capsys):
    assert main(["certify", "upright/own", "--out", str(tmp_path / "out"), *changes]) == 2
    assert words in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("key", ["torque", "friction", "softness"])
def test_realities_that_nobody_modelled_are_random(key):
    still = ["start.jitter=0"]
    with pytest.raises(InputError, match="nothing random"):
        check_random(plan_of("upright/own", still))
    check_random(plan_of("upright/own", [*still, f"truth.unmodelled.{key}=0.1"]))
