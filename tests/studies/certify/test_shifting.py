"""Shifted runs: their weights, on problems of known probability, the runs themselves, and what is said of too few."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest
from msgspec.structs import replace

from biped.ensemble.campaign import simulate
from biped.scenario.randomise import Move, Normals, Shift
from biped.scenario.reading import read_scenario, to_toml
from biped.scenario.vary import stream
from biped.studies.certify import process_of
from biped.studies.certify.estimation import COUNTING, SHIFTING, Accuracy, of_weights
from biped.studies.certify.reference import NarrowPlace, Pendulum, Regulated, estimate, normals_of
from biped.studies.certify.shifting import AFTER, LENGTH, Mixture, Pattern, Process, Stages, weighted
from biped.studies.run import plan_of
from tests.studies.certify.problems import Timeless, Trap

TIMES = tuple(0.1 * k for k in range(31))


def drawn(run):
    """Two directions of a process."""
    return stream(Normals(int(run), run.moves), "force").standard_normal((len(TIMES), 2), np.array(TIMES))


def patterns(directions, blocks, seed=3):
    """Any patterns: strong and weak, narrow and wide, at some times more often than at others."""
    rng, out = np.random.default_rng(seed), []
    for by, spread in ((1.5, 0.7), (2.0, 1.0), (1.0, 1.3)):
        direction = rng.standard_normal((LENGTH, directions))
        out.append(Pattern(direction / np.linalg.norm(direction), by, spread, rng.random(blocks + AFTER)))
    return out


@pytest.mark.parametrize(
    "process",
    [
        Process(TIMES, 2, (0, 1), drawn),
        Process(TIMES, 5, (1,), drawn),
        Process(Pendulum.times, 1, (0,), partial(normals_of, times=Pendulum.times)),
    ],
)
def test_weights_are_the_ratio_of_the_densities_that_runs_are_drawn_from(process):
    mixture = Mixture(patterns(len(process.acts), len(process.sizes)), process)
    blocks = process.blocks_of(mixture.draw(np.random.default_rng(1), 6000))
    weights = mixture.weights(blocks)
    # A weighted draw is a plain one: of mean 1, and its numbers of mean 0 and mean square 1.
    for value, known in ((np.ones(len(blocks)), 1.0), (blocks[:, 0, 0], 0.0), (blocks[:, 3, 0] ** 2, 1.0),
                         (blocks[:, -1, -1], 0.0), (blocks[:, 2:5, 0].sum(axis=1) ** 2, 3.0)):  # fmt: skip
        terms = weights * value
        assert abs(terms.mean() - known) < 4.0 * terms.std() / math.sqrt(len(terms))
    assert weights.max() <= 10.0


def test_a_shifted_run_has_the_shift_and_the_spread_of_its_pattern():
    weights = np.array([[0.6, 0.0], [0.0, 0.8]]) / math.sqrt(2.0)
    shift = Shift(pattern=tuple(map(tuple, weights.tolist())), each=2, by=2.5, spread=0.5)
    move = Move(beta=0.0, keep=1.0, after=TIMES[4], shift=shift)
    moved, plain = (np.array([drawn(Normals(seed, moves)) for seed in range(3000)]) for moves in ((move,), ()))
    along = (moved[:, 4:8] * np.repeat(weights, 2, axis=0)).sum(axis=(1, 2))
    assert along.mean() == pytest.approx(2.5, abs=4.0 * 0.5 / math.sqrt(3000))
    assert along.std() == pytest.approx(0.5, rel=0.06)
    assert (moved[:, :4] == plain[:, :4]).all()
    assert (moved[:, 8:] == plain[:, 8:]).all()
    before = (plain[:, 4:8] * np.repeat(weights, 2, axis=0)).sum(axis=(1, 2))
    assert along == pytest.approx(2.5 + 0.5 * before)


@pytest.mark.parametrize("problem", [Pendulum(3.7190), Regulated(8.25), NarrowPlace(3.7)])
def test_shifted_runs_find_known_probabilities(problem):
    estimates, held = [], 0
    for seed in range(8):
        found, runs = estimate(problem, seed, Accuracy(most=5000, method=SHIFTING))
        assert found.method == SHIFTING
        assert runs <= 5000
        estimates.append(found.probability.value)
        held += found.probability.low <= problem.falls() <= found.probability.high
    assert abs(np.mean(estimates) / problem.falls() - 1.0) < 4.0 * np.std(estimates) / np.mean(estimates) / math.sqrt(8)
    assert held >= 6  # of 8 intervals of 95 %, fewer hold in one of 170 tests


def test_the_probability_of_a_narrow_passage_is_that_of_a_count():
    problem = NarrowPlace(2.0)
    falls = sum(problem(Normals(seed)).fell for seed in range(4000))
    assert abs(falls / 4000 - problem.falls()) < 4.0 * math.sqrt(problem.falls() / 4000)


def test_stages_are_weighed_by_their_runs_and_the_root_of_their_number():
    process = Process(Pendulum.times, 1, (0,), partial(normals_of, times=Pendulum.times))
    mixture = Mixture(patterns(1, len(process.sizes)), process)
    fell = [Normals(seed) for seed in (3, 4, 5)]
    weights, stages = mixture.weights(process.blocks_of(fell)), Stages(process)
    assert stages.add(mixture, 100, fell[:2]).mean == pytest.approx(weights[:2].sum() / 100)
    share = 200 * math.sqrt(2.0) / (100 + 200 * math.sqrt(2.0))
    both = stages.add(mixture, 200, fell[2:])
    assert both.mean == pytest.approx((1.0 - share) * weights[:2].sum() / 100 + share * weights[2] / 200)
    assert both.runs == 300


def test_falls_that_no_pattern_leads_to_are_counted_too():
    found, _ = estimate(Trap(8.25), 3, Accuracy(most=6000, method=SHIFTING, relative=1e-3))
    known = 1.0 - (1.0 - Regulated(8.25).falls()) * 0.98
    assert found.probability.low < known < found.probability.high


def test_an_interval_is_as_wide_as_the_falls_that_decide_it_are_few():
    many, one = weighted(np.full(50, 0.01), 1000), weighted(np.array([2.0, *[0.01] * 50]), 1000)
    assert many == (pytest.approx(5e-4), pytest.approx(50.0), 1000, pytest.approx(1e-5))
    assert of_weights(many).high / of_weights(many).value > 1.019 * of_weights(many).value / of_weights(many).low
    assert one.effective < 2.0
    assert of_weights(many).relative < 0.35
    assert of_weights(one).relative > 5.0
    assert of_weights(weighted(np.empty(0), 100)) == (0.0, 0.0, 1.0)


@pytest.mark.parametrize("most", [250, 900, 8000])
def test_no_more_runs_are_made_than_asked_for(most):
    found, runs = estimate(Pendulum(4.2649), 1, Accuracy(most=most, method=SHIFTING, relative=1e-3))
    assert runs == most
    assert found.method == (COUNTING if most < 8000 else SHIFTING)


def test_where_nothing_can_be_shifted_runs_are_counted():
    found, _ = estimate(Timeless(2.0), 1, Accuracy(most=1000, method=SHIFTING))
    assert found.method == COUNTING
    assert "nothing that is drawn has a time" in found.doubt


def test_a_shifted_walk_is_repeated_to_the_last_bit_by_its_scenario(tmp_path):
    plan = plan_of("upright/own", ["disturbance={force=[40.0,0.0]}", "duration=2"])
    process = process_of(plan)
    assert process.acts == (0,)
    assert process.each == 5
    run = next(
        run for run in Mixture(patterns(1, len(process.sizes)), process).draw(np.random.default_rng(2), 20) if run.moves
    )
    moves = (Move(seed=int(run)), *run.moves)
    file = tmp_path / "run.toml"
    file.write_text(to_toml(replace(plan.scenario, randomise=replace(plan.scenario.randomise, moves=moves))))
    again = read_scenario(str(file))
    assert again.randomise.moves == moves
    first, second = (simulate(plan.run_from(seed)) for seed in (run, Normals(5, again.randomise.moves)))
    plain = simulate(plan.run_from(Normals(int(run))))
    assert (first.com == second.com).all()
    assert not np.array_equal(first.com, plain.com)


def test_draws_that_change_the_force_s_times_leave_nothing_to_shift():
    force = "disturbance={force=[40.0,0.0]}"
    assert (
        process_of(plan_of("upright/own", [force, 'randomise.draw."disturbance.correlation".uniform=[0.1,0.3]']))
        is None
    )
    assert process_of(plan_of("upright/own", [force, 'randomise.draw."ground.friction".uniform=[0.8,1.0]'])) is not None
    assert process_of(plan_of("upright/own", [])) is None
