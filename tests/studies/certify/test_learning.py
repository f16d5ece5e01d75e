"""The score that is learned: the regression, the states that it is of, and what stronger disturbances teach."""

from __future__ import annotations

import numpy as np
import pytest

from biped.ensemble.campaign import simulate
from biped.scenario.normals import Normals
from biped.studies.certify.learning import FALLS, fitted, learned
from biped.studies.certify.outcome import LEARNT_EVERY, outcome_of
from biped.studies.certify.reference import Regulated
from biped.studies.certify.running import Outcomes
from biped.studies.certify.scores import horizon_of, states_of
from biped.studies.planned import plan_of


def test_the_regression_finds_the_odds_that_labels_were_drawn_with():
    rng = np.random.default_rng(1)
    states = np.column_stack([rng.standard_normal((40_000, 2)), np.full(40_000, 3.0)])  # the last one never changes
    odds = -2.0 + 1.5 * states[:, 0] - 0.8 * states[:, 0] * states[:, 1]
    labels = rng.random(len(odds)) < 1.0 / (1.0 + np.exp(-odds))
    score = fitted(np.column_stack([states, labels]))
    near = np.abs(states[:, :2]).max(axis=1) < 1.5
    assert np.abs(score(states[near]) - odds[near]).max() < 0.5
    assert np.corrcoef(score(states), odds)[0, 1] > 0.99


class Recorded(Regulated):
    """The regulated walk with its states: the deviation, and whether the walk falls within two steps."""

    def __call__(self, request):
        """The outcome of a run that is asked for."""
        run = request.run
        out = super().__call__(run)
        signed = [(time, value if which == 0 else -value) for time, which, value in out.rises]
        states = [(value, float(out.fell and out.end - time <= 2.0)) for time, value in signed]
        return out._replace(states=tuple(states))


def test_a_score_is_learned_from_stronger_disturbances_where_nothing_falls():
    walk = Recorded(5.5)  # one run in sixty
    outcomes = Outcomes(lambda wanted: map(walk, wanted), {}, lambda _, outcome: outcome, lambda: None)
    score = learned(3, outcomes, 0)
    assert score is not None
    odds = score(np.array([[0.0], [1.5], [3.0], [4.5], [-4.5]]))
    assert np.all(np.diff(odds[:4]) > 0.0)
    assert odds[4] == pytest.approx(odds[3], abs=1.5)
    assert sum(state[-1] for state in outcomes.states) >= FALLS


def test_no_score_is_learned_where_nothing_falls_however_strong_the_disturbance():
    walk = Recorded(1e3)
    outcomes = Outcomes(lambda wanted: map(walk, wanted), {}, lambda _, outcome: outcome, lambda: None)
    assert learned(3, outcomes, 0) is None


def test_states_of_a_walk_are_in_natural_units_and_labels_are_those_of_its_end():
    plan = plan_of("upright/own", ["push=[{at=0.5,duration=0.3,force=[400.0,0.0]}]", "duration=3"])
    t = simulate(plan.run_from(Normals(0)))
    states = states_of(t, 3.0)
    assert np.isfinite(states).all()
    assert np.abs(states[:, [1, 3, 5, 9, 11]]).max() < 1e-9  # nothing is to the side in the plane
    assert states[0, 6] == pytest.approx(t.com[0, 2] / t.robot.leg)
    assert states[-1, 8] == pytest.approx(t.lean[10 * (len(states) - 1)])
    rate = np.gradient(states[:, 8]) / (0.01 / np.sqrt(t.robot.leg / 9.81))
    assert np.corrcoef(states[5:-1, 10], rate[5:-1])[0, 1] > 0.95
    outcome = outcome_of(t, None, 3.0, learns=True)
    labels = [state[-1] for state in outcome.states]
    assert outcome.fell
    assert labels == sorted(labels)
    assert sum(labels) == pytest.approx(horizon_of(t) / (LEARNT_EVERY * 0.01), abs=1.5)
