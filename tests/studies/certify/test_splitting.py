"""Splitting against pendulums and walks whose probability of a fall is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from biped.base.statistics import wilson
from biped.scenario.randomise import Move, Normals
from biped.scenario.vary import stream
from biped.studies.certify.estimation import Accuracy, combined, counted, plain_is_cheaper
from biped.studies.certify.outcome import RunOutcome
from biped.studies.certify.reference import Pendulum, Regulated, _drawn, estimate, validate
from biped.studies.certify.splitting import baseline_of
from tests.studies.certify.problems import Capped, Jumping, Timeless, Trap


def test_the_known_probabilities_are_those_of_plain_runs():
    for problem in (Pendulum(1.0), Regulated(3.0)):
        low, high = wilson(sum(problem(Normals(seed)).fell for seed in range(2000)), 2000, z=3.5)
        assert low <= problem.falls() <= high


@pytest.mark.parametrize("case", ["pendulum", "walk", "timeless"])
def test_the_mean_of_samples_is_the_known_probability(case):
    problem = {"pendulum": Pendulum(3.09), "walk": Regulated(6.2), "timeless": Timeless(3.09)}[case]
    known = problem.falls()
    found, _ = estimate(problem, 3, Accuracy(most=9000, relative=1e-3, size=60, method="splitting"))
    estimates = np.array([sample.probability for sample in found.samples])
    assert 5e-4 < known < 5e-3
    assert len(estimates) >= 10
    assert abs(estimates.mean() - known) < 4.0 * estimates.std(ddof=1) / math.sqrt(len(estimates))
    assert found.probability.value == pytest.approx(estimates.mean())
    assert not found.doubt


def test_one_in_a_hundred_thousand_takes_a_hundredth_of_the_plain_runs():
    problem = Pendulum(4.265)
    found, runs = estimate(problem, 4, Accuracy(most=10_000, relative=1e-3))
    known = problem.falls()
    assert runs <= 10_000
    assert known == pytest.approx(1e-5, rel=0.01)
    assert found.probability.low < known < found.probability.high
    assert sum(outcome.fell for outcome in found.plain) == 0
    assert all(outcome.fell for _, outcome in found.fell)


def test_frequent_falls_are_counted_and_only_counted():
    found, _ = estimate(Regulated(3.0), 5, Accuracy(relative=0.2))
    falls = sum(outcome.fell for outcome in found.plain)
    assert not found.samples
    assert found.reached
    assert found.probability == counted(falls, len(found.plain))
    assert found.probability.relative <= 0.2


def test_a_score_that_does_not_grade_is_called_so_and_runs_are_counted():
    walk = Jumping(6.0)
    found, _ = estimate(walk, 6, Accuracy(most=2000, method="splitting"))
    assert "stopped rising" in found.doubt
    assert not found.samples
    assert found.probability.low < walk.falls() < found.probability.high


def test_levels_end_where_the_score_rises_no_further_and_some_fall():
    walk = Capped(5.6)
    found, _ = estimate(walk, 8, Accuracy(most=9000, relative=1e-3, method="splitting", size=60))
    estimates = np.array([sample.probability for sample in found.samples])
    assert found.levels.values[-1] + min(found.levels.baseline) <= 0.75 * 5.6 + 1e-9
    assert len(estimates) >= 10
    assert abs(estimates.mean() - walk.falls()) < 4.0 * estimates.std(ddof=1) / math.sqrt(len(estimates))


def test_falls_that_no_level_leads_to_are_counted_too():
    found, _ = estimate(Trap(6.5), 7, Accuracy(most=9000, relative=1e-3, method="splitting", size=60))
    known = 1.0 - (1.0 - Regulated(6.5).falls()) * 0.98
    estimates = np.array([sample.probability for sample in found.samples])
    assert abs(estimates.mean() - known) < 4.0 * estimates.std(ddof=1) / math.sqrt(len(estimates))


def test_counting_is_cheaper_of_frequent_falls_alone():
    assert plain_is_cheaper(20, 200, 0.25)
    assert not plain_is_cheaper(0, 200, 0.25)


def test_intervals_of_estimates_widen_with_their_scatter():
    narrow, wide = combined([1e-3] * 8 + [1.1e-3] * 2), combined([1e-4, 2e-3] * 5)
    assert narrow.high / narrow.low < 1.1 < wide.high / wide.low
    least = combined([1e-3] * 5, least=0.5)
    variance = math.log(1.25)  # of lognormal numbers whose relative standard deviation is 0.5
    error = max(0.5 / math.sqrt(5), math.sqrt(variance / 5 + variance**2 / 8))
    assert least.high / least.value == pytest.approx(math.exp(2.776 * error), rel=1e-3)


def test_intervals_of_lognormal_estimates_hold_their_mean():
    rng, held = np.random.default_rng(8), 0
    for _ in range(400):
        found = combined(list(rng.lognormal(-0.6, math.sqrt(1.2), 12)))
        held += found.low <= 1.0 <= found.high
    assert held >= 0.93 * 400
    assert combined([0.0] * 5) == (0.0, 0.0, 1.0)


def test_moved_normals_are_standard_normal_and_a_branch_keeps_what_was():
    times = np.array(Pendulum.times)
    moves = [Move(seed=11, beta=0.4), Move(seed=12, beta=0.9, after=times[6]), Move(seed=13, after=times[9])]
    drawn = stream(Normals(7, moves), "pushes").standard_normal(len(times), times)
    assert (_drawn(Normals(7, moves), Pendulum.times) == drawn).all()
    base = [stream(Normals(seed, moves[:1]), "pushes").standard_normal(len(times), times) for seed in range(3000)]
    moved = np.array(
        [stream(Normals(seed, moves), "pushes").standard_normal(len(times), times) for seed in range(3000)]
    )
    assert (np.array(base)[:, :6] == moved[:, :6]).all()
    assert (np.array(base)[:, 6:] != moved[:, 6:]).all()
    # Seeds differ in the first numbers alone: those that the moves add are the same for all.
    fresh = [stream(Normals(seed, [Move(seed=seed + 10_000, beta=0.5)]), "a").standard_normal() for seed in range(4000)]
    assert abs(np.mean(fresh)) < 4.0 / math.sqrt(4000)
    assert np.std(fresh) == pytest.approx(1.0, abs=0.05)
    uniform = [stream(Normals(seed), "a").uniform(2.0, 4.0) for seed in range(2000)]
    assert min(uniform) > 2.0
    assert max(uniform) < 4.0
    assert np.mean(uniform) == pytest.approx(3.0, abs=0.06)
    whole = [stream(Normals(seed), "a").integers(3) for seed in range(300)]
    assert set(whole) == {0, 1, 2}


def test_scores_are_above_baselines_and_reached_where_they_first_rise():
    outcome = RunOutcome(False, 5.0, ((1.0, 0, 0.2), (2.0, 1, 0.5), (3.0, 0, 0.6)))
    assert outcome.score((0.0, 0.0)) == 0.6
    assert outcome.score((0.5, 0.0)) == 0.5
    assert outcome.reached(0.4, (0.5, 0.0)) == 2.0
    assert outcome.reached(9.0, (0.0, 0.0)) == 5.0
    assert baseline_of([outcome, outcome._replace(rises=((1.0, 0, 0.2), (2.0, 1, 0.5)))])[1:] == (math.inf,)
    assert outcome._replace(fell=True).score((0.0, 0.0)) == math.inf


@pytest.mark.slow
def test_intervals_hold_the_known_probabilities_in_93_of_100():
    for found in validate(100, 1):
        assert found.held >= 93
        assert 0.6 * found.known < found.mean < 1.6 * found.known
