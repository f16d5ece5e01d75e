"""The score that is learned: the regression, the states that it is of, and what stronger disturbances teach."""

from __future__ import annotations

import math

import numpy as np
import pytest

from biped.ensemble.campaign import simulate
from biped.robot.ground import GRAVITY
from biped.scenario.randomise import Move, Normals
from biped.studies.certify.outcome import LEARNT_EVERY, LEFT, NEVER, horizon_of, outcome_of, states_of, time_left
from biped.studies.certify.reference import Regulated
from biped.studies.certify.running import Outcomes, multiplied, since_of
from biped.studies.certify.splitting import FALLS, fitted, learned
from biped.studies.run import plan_of


def test_the_regression_finds_the_odds_that_labels_were_drawn_with():
    rng = np.random.default_rng(1)
    states = np.column_stack([rng.standard_normal((40_000, 2)), np.full(40_000, 3.0)])  # the last one never changes
    odds = -2.0 + 1.5 * states[:, 0] - 0.8 * states[:, 0] * states[:, 1]
    labels = rng.random(len(odds)) < 1.0 / (1.0 + np.exp(-odds))
    score = fitted(np.column_stack([states, np.where(labels, 0.0, NEVER)]))
    near = np.abs(states[:, :2]).max(axis=1) < 1.5
    assert np.abs(score(states[near]) - odds[near]).max() < 0.5
    assert np.corrcoef(score(states), odds)[0, 1] > 0.99


class Recorded(Regulated):
    """The regulated walk with its states: the deviation, and no time until the fall if it falls within two steps."""

    def __call__(self, request):
        """The outcome of a run that is asked for."""
        run = request.run
        out = super().__call__(run)
        signed = [(time, value if which == 0 else -value) for time, which, value in out.rises]
        states = [(value, 0.0 if out.fell and out.end - time <= 2.0 else NEVER) for time, value in signed]
        return out._replace(states=tuple(states))


def test_a_score_is_learned_from_stronger_disturbances_where_nothing_falls():
    walk = Recorded(5.5)  # one run in sixty
    outcomes = Outcomes(lambda wanted: map(walk, wanted), {}, lambda _, outcome: outcome, lambda: None)
    score = learned(3, outcomes, 0, None)
    assert score is not None
    odds = score(np.array([[0.0], [1.5], [3.0], [4.5], [-4.5]]))
    assert np.all(np.diff(odds[:4]) > 0.0)
    assert odds[4] == pytest.approx(odds[3], abs=1.5)
    assert sum(state[-1] == 0.0 for state in outcomes.states) >= FALLS


def test_no_score_is_learned_where_nothing_falls_however_strong_the_disturbance():
    walk = Recorded(1e3)
    outcomes = Outcomes(lambda wanted: map(walk, wanted), {}, lambda _, outcome: outcome, lambda: None)
    assert learned(3, outcomes, 0, None) is None


def test_states_of_a_walk_are_in_natural_units_and_labels_are_those_of_its_end():
    plan = plan_of("upright/own", ["push=[{at=0.5,duration=0.3,force=[400.0,0.0]}]", "duration=3"])
    t = simulate(plan.run_from(Normals(0)))
    states = states_of(t, 3.0)
    assert np.isfinite(states).all()
    assert np.abs(states[:, [1, 3, 5, 9, 11, 20, 21]]).max() < 1e-9  # nothing is to the side in the plane
    assert states[0, 6] == pytest.approx(t.com[0, 2] / t.robot.leg)
    assert states[-1, 8] == pytest.approx(t.lean[10 * (len(states) - 1)])
    rate = np.gradient(states[:, 8]) / (0.01 / np.sqrt(t.robot.leg / 9.81))
    assert np.corrcoef(states[5:-1, 10], rate[5:-1])[0, 1] > 0.95
    times, pushed = 0.01 * np.arange(len(states)), states[:, 19]
    assert np.allclose(pushed[(times > 0.505) & (times < 0.795)], 400.0 / (t.mass * GRAVITY))
    assert np.all(pushed[(times < 0.495) | (times > 0.805)] == 0.0)
    assert states[0, LEFT] == 0.0  # more is left than the horizon
    outcome = outcome_of(t, None, 3.0, since=0.0)
    until = np.array([state[-1] for state in outcome.states])
    assert outcome.fell
    assert until[0] == pytest.approx(t.time[-1] / horizon_of(t), abs=1e-4)
    assert np.allclose(np.diff(until), -LEARNT_EVERY * 0.01 / horizon_of(t), atol=2e-4)
    later = outcome_of(t, None, 3.0, since=0.7).states
    assert later == outcome.states[-len(later) :]
    assert len(later) == len(outcome.states) - 14


def test_what_less_time_would_have_made_of_a_walk_is_learned_too():
    rng = np.random.default_rng(2)
    danger = rng.standard_normal(30_000)
    odds = 2.0 * danger - 2.0  # of a fall while all the time is left; less by 1.5 times its logarithm while less is
    chance = rng.random(len(danger))
    until = np.exp((np.log(chance / (1.0 - chance)) - odds) / 1.5)
    rows = np.column_stack([danger, np.zeros(len(danger)), np.where(until < 1.0, until, NEVER)])
    score = fitted(rows, 1)
    for share in (0.3, 0.5, 1.0):
        found = score(np.column_stack([[0.0, 1.0, 2.0], time_left(np.full(3, share))]))
        known = np.array([-2.0, 0.0, 2.0]) + 1.5 * math.log(share)
        assert 1.0 / (1.0 + np.exp(-found)) == pytest.approx(1.0 / (1.0 + np.exp(-known)), abs=0.03)


def test_nothing_is_learned_from_what_was_chosen():
    run = Normals(1)
    assert since_of(run) == 0.0
    assert since_of(run.moved(Move(seed=2, after=1.5))) == 1.5
    assert since_of(run.moved(Move(seed=2, beta=0.5))) == math.inf
    assert since_of(run.moved(Move(beta=0.0, keep=2.0, after=1e-9))) == 0.0
    assert multiplied(run.moved(Move(beta=0.0, keep=2.0)))
    assert not multiplied(run.moved(Move(seed=2)))
