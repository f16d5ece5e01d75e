"""Splitting and shifting on a walker against the count of its plain runs."""

from __future__ import annotations

import pytest

from biped.scenario.vary import piece_times, stream
from biped.studies.certify import process_of
from biped.studies.certify.estimation import Accuracy, combined, estimated, levels_of
from biped.studies.certify.running import MakingOutcomes, Outcomes
from biped.studies.certify.splitting import Moving, least_scatter, sampled
from biped.studies.run import plan_of


def problem(name, force, duration=4):
    plan = plan_of(name, [f"disturbance={{force=[{force},0.0]}}", f"duration={duration}"])
    make = MakingOutcomes(plan)
    outcomes = Outcomes(lambda wanted: map(make, wanted), {}, lambda _, outcome: outcome, lambda: None)
    return plan, outcomes, Moving(tuple(piece_times(plan.scenario)))


@pytest.mark.slow
def test_intervals_of_a_walker_hold_the_count_of_its_plain_runs():
    _, outcomes, moving = problem("upright/own", 30.0)
    repeats, each, size = 15, 5, 30
    first = outcomes.plain(stream(2, "certify.plain"), 200)
    levels = levels_of(2, outcomes, first, moving, Accuracy(most=10**6, method="splitting"))
    held = 0
    for repeat in range(repeats):
        samples = outcomes.finish([sampled(2000, repeat * each + i, size, levels, moving) for i in range(each)])
        found = combined([sample.probability for sample in samples], least_scatter(samples, size))
        held += found.low <= 34 / 5685 <= found.high
    assert held >= 14


@pytest.mark.slow
def test_intervals_of_shifted_runs_of_a_walker_hold_the_count_of_its_plain_runs():
    held, counted = 0, 6 / 53_405  # biped certify, --method counting, seed 9200
    for seed in range(12):
        plan, outcomes, moving = problem("upright/own", 38.0, 2)
        accuracy = Accuracy(relative=0.5, most=8000, method="shifting")
        found = estimated(4000 + seed, outcomes, moving, accuracy, process_of(plan)).probability
        held += found.low <= counted <= found.high
    assert held >= 10
