"""Errors of M and A that are drawn anew at every tick: their distribution, and whom they depend on."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest

from biped.base.errors import InputError
from biped.control.planar.setup import controller_record, redraw, uniform
from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.scenario.reading import read

TICKS = 300


def belief_of(*changes: str):
    """The belief of a controller whose errors are drawn at every tick."""
    run = Plan(*read("level_normal", ["randomise.controller_errors=tick", *changes])).run(0)
    return controller_record(run, run.tree)[0]["belief"]


def drawn(belief, count: int) -> tuple[np.ndarray, np.ndarray]:
    """(count, 9, 9) and (count, 10, 9) factors of as many ticks."""
    masses, rows = [], []
    for _ in range(count):
        redraw(belief)
        masses.append(belief["mass_factor"].copy())
        rows.append(belief["row_factor"].copy())
    return np.array(masses), np.array(rows)


def test_uniform_numbers_are_those_of_the_published_generator():
    a, b = 12345, 67890
    generator = np.array([a, b])
    for _ in range(1000):
        a, b = a * 40014 % 2147483563, b * 40692 % 2147483399
        assert uniform(generator) == ((a - b) if a > b else (a - b + 2147483562)) / 2147483563
        assert tuple(generator) == (a, b)


def test_factors_are_normal_and_independent():
    masses, rows = drawn(
        belief_of("randomise.controller_mass_matrix=0.1", "randomise.controller_constraints=0.2"), TICKS
    )
    for factors, deviation in ((masses, 0.1), (rows, 0.2)):
        z = (factors - 1.0) / deviation
        assert kstest(z.ravel(), "norm").pvalue > 1e-3
        assert np.abs(z.mean(axis=0)).max() < 4.5 / np.sqrt(TICKS)
        for one, other in ((z[1:], z[:-1]), (z[..., 1:], z[..., :-1]), (z[:, 1:], z[:, :-1])):
            assert abs(np.mean(one * other)) < 4.0 / np.sqrt(one.size)


def test_what_is_right_stays_right():
    masses, rows = drawn(belief_of("randomise.controller_constraints=0.1"), 3)
    assert (masses == 1.0).all()
    assert rows.std() > 0.05


def test_draws_belong_to_the_seed_of_a_run():
    sizes = "randomise.controller_mass_matrix=0.1", "randomise.controller_constraints=0.1"
    one, again, other = (drawn(belief_of(*sizes, f"seed={seed}"), 3)[0] for seed in (1, 1, 2))
    assert (one == again).all()
    assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.3


def test_a_walk_with_errors_at_every_tick_is_another_and_comes_again():
    walks = []
    for how in ("tick", "tick", "run"):
        changes = [f"randomise.controller_errors={how}", "randomise.controller_mass_matrix=0.1", "duration=0.3",
                   "window={start=0.0,end=0.3}"]  # fmt: skip
        walks.append(simulate(Plan(*read("level_normal", changes)).run(0)).u)
    assert (walks[0] == walks[1]).all()
    assert np.abs(walks[0] - walks[2]).max() > 1.0


def test_another_word_is_refused():
    with pytest.raises(InputError, match="controller_errors"):
        read("level_normal", ["randomise.controller_errors=step"])
