"""Growth of small pushes: a gait whose multiplier is known otherwise, and states that do not know place and heading."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from biped.cli.main import main
from biped.ensemble.campaign import simulate
from biped.studies.run import plan_of
from biped.studies.stability.growth import SIZES, STRIDES, _growth, states_of


def test_growth_of_a_geometric_sequence_is_its_ratio():
    rng = np.random.default_rng(1)
    group = [(False, [scale * 3.0**k for k in range(STRIDES)]) for scale in (1e-7, 2e-7, 5e-8)]
    found = _growth(1e-7, group, rng)
    assert found.factor == pytest.approx(3.0)
    assert found.low == pytest.approx(3.0)
    assert found.high == pytest.approx(3.0)
    large = _growth(1.0, [(True, [0.01, 0.05, 5.0, 5.0])], rng)  # from large distances on nothing is counted
    assert large.factor == pytest.approx(np.sqrt(5.0 * 100.0))
    assert large.fell == 1


def test_states_do_not_know_where_a_walk_is():
    run = simulate(plan_of("upright/own", ["duration=0.5"]).run(0))
    moved = replace(run, log=run.log.copy())
    first = moved.columns["q"][0]
    moved.log[:, first] += 7.0
    assert np.allclose(states_of(moved), states_of(run), atol=1e-9)
    assert np.isfinite(states_of(run)).all()


@pytest.mark.slow
def test_pushes_of_the_stable_gait_die_out_as_its_multiplier_says(capsys):
    """docs/stability.md: the largest multiplier per return is 0.716, found by Newton's method on the return map."""
    assert main(["stability", "level_slow_generalized", "--growth", "--json"]) == 0
    sizes = json.loads(capsys.readouterr().out)["sizes"]
    assert [one["size"] for one in sizes] == list(SIZES)
    assert sizes[-1]["factor"] < 1.0
