"""Ways to fall: made likelier as long as they fall alike, and made again to the last bit from their files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from biped.cli.main import main
from biped.scenario.randomise import Move, Normals
from biped.studies.certify.outcome import RunOutcome
from biped.studies.certify.reference import Pendulum, Regulated
from biped.studies.certify.running import Outcomes
from biped.studies.find import distinct, plainer
from biped.studies.run import plan_of

FORCE = "disturbance={force=[250.0,0.0],correlation=0.2}"


@pytest.mark.parametrize("case", ["pendulum", "walk"])
def test_a_failure_is_made_likelier_and_still_falls(case):
    problem, duration = {"pendulum": (Pendulum(1.5), 0.6), "walk": (Regulated(3.0), 20.0)}[case]

    def met(run):
        fresh = Normals(int(run), run.moves)
        return problem(fresh)._replace(squares=fresh.squares, way="forward")

    first = next((run, met(run)) for run in map(Normals, range(200)) if problem(run).fell)
    outcomes = Outcomes(
        lambda requests: (met(request.run) for request in requests), {}, lambda _, outcome: outcome, lambda: None
    )
    (found,) = outcomes.finish([plainer(first, duration)])
    run, outcome = found
    assert problem(run).fell
    assert met(run) == outcome
    assert outcome.squares < 0.7 * first[1].squares
    if case == "pendulum":  # the likeliest fall of all lies at 1.5 standard deviations
        assert outcome.squares >= 1.5**2 - 1e-9


def test_failures_are_found_and_made_again_from_their_files(tmp_path, capsys):
    out = tmp_path / "out"
    sets = ["--set", FORCE, "--set", "duration=1.5", "--set", "fall.tilt=40"]
    code = main(["find", "upright/own", *sets, "--most", "200", "--failures", "2", "--out", str(out), "--json"])
    found = json.loads(capsys.readouterr().out)
    assert code == 1
    assert found["falls"] > 0
    assert found["plain"] == 200
    assert 1 <= len(found["found"]) <= 2
    assert found["falls"] == found["distinct"] >= found["cells"] >= 1  # plain runs have nothing in common
    for one in found["found"]:
        assert one["squares"] < one["before"]
        file = Path(out, Path(one["file"]).name)
        assert main(["run", str(file), "--json", "--out", str(tmp_path / file.stem)]) in (0, 1)
        (run,) = json.loads(capsys.readouterr().out)["runs"]
        assert run["fell"]
        assert run["time"] == pytest.approx(one["end"], abs=2e-3)
    assert np.all(np.diff([one["squares"] for one in found["found"]]) >= 0.0)
    assert "ways to fall" in (out / "find.md").read_text()


def test_falls_that_share_the_force_before_them_count_once():
    scenario = plan_of("upright/own", [FORCE, "duration=4"]).scenario
    outcome = RunOutcome(True, 3.0, ())
    run = Normals(5)
    runs = [run, run.moved(Move(seed=6, after=2.7)), run.moved(Move(seed=6, after=2.3)), Normals(7)]
    apart = distinct(scenario, [(one, outcome) for one in runs])
    assert [one for one, _ in apart] == [runs[0], runs[2], runs[3]]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["--set", "start.jitter=0"], "nothing random in this scenario"),
        (["--failures", "0", "--set", FORCE], "--failures 0"),
        (["--most", "10", "--set", FORCE], "--most 10"),
        (["--against", "controller=nosuch", "--set", FORCE], "nosuch"),
    ],
)
def test_what_cannot_be_searched_is_refused_in_one_sentence(changes, words, tmp_path, capsys):
    assert main(["find", "upright/own", "--out", str(tmp_path / "out"), *changes]) == 2
    assert words in " ".join(capsys.readouterr().err.split())
