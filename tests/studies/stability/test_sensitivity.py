"""Gait sensitivity norm: responses in closed form, scatter that is taken off, kinds of disturbances, the command."""

from __future__ import annotations

import json

import numpy as np
import pytest

from biped.cli.main import main
from biped.ensemble.campaign import simulate
from biped.studies.run import plan_of
from biped.studies.stability import sensitivity as studied
from biped.studies.stability.sensitivity import INDICATORS, _alternate, _norm, beyond_scatter
from tests.cases import command


def test_the_norm_of_a_response_that_dies_out_geometrically():
    """H2 norm of a first-order system: c / √(1 - a²) of a response c a^k to a unit disturbance."""
    a, c, size = 0.7, 3.0, 0.05
    changes = size * c * a ** np.arange(60.0)[:, None] * np.array([1.0, -2.0])
    found = _norm("push", size, [beyond_scatter(changes, np.zeros(2), size)] * 3, np.random.default_rng(1))
    whole = c / np.sqrt(1.0 - a * a)
    assert found.parts == pytest.approx((whole, 2.0 * whole))
    assert found.norm == pytest.approx(np.sqrt(5.0) * whole)
    assert (found.low, found.high) == pytest.approx((found.norm, found.norm))


def test_scatter_without_a_disturbance_is_no_response():
    rng, size, std = np.random.default_rng(3), 0.05, np.array([0.01, 0.03])
    found = _norm("push", size, [beyond_scatter(std * rng.normal(size=(12, 2)), std**2, size) for _ in range(400)], rng)
    assert found.low == 0.0
    alone = np.sqrt(12.0 * (std**2).sum()) / size
    assert found.high < 0.3 * alone


def test_walks_that_fell_do_not_count():
    rng = np.random.default_rng(1)
    found = _norm("push", 0.1, [None, [4.0, 5.0], None], rng)
    assert (found.walks, found.fell, found.norm) == (3, 2, 3.0)
    none = _norm("push", 0.1, [None, None], rng)
    assert none.fell == 2
    assert np.isnan(none.norm)


def test_a_foot_that_strikes_again_begins_no_step():
    t = simulate(plan_of("upright/own", ["duration=6.0"]).run(0))
    rows, feet = _alternate(t)
    assert len(rows) > 6
    assert (np.diff(feet) != 0).all()
    assert set(rows) <= {row for row, _ in t.strikes}


def test_the_command(capsys, monkeypatch):
    monkeypatch.setattr(studied, "MOMENTS", 2)
    code, found = command(capsys, "stability", "upright/own", "--norm", "--jobs", "1")
    assert code == 0
    assert [one["disturbance"] for one in found["kinds"]] == ["push forward", "push backward", "step up", "step down"]
    for one in found["kinds"]:
        assert one["fell"] == 0
        assert one["low"] <= one["norm"] <= one["high"]
        assert one["norm"] == pytest.approx(np.hypot(*one["parts"]), rel=0.2)
        assert len(one["parts"]) == len(INDICATORS)
    assert main(["stability", "upright/own", "--norm", "--jobs", "1"]) == 0
    assert "step down" in capsys.readouterr().out


def test_ground_that_cannot_step_is_not_asked_to():
    run = plan_of("any/h1", ["duration=1.2"]).run(0)
    kinds = [words for words, *_ in studied._kinds(run, simulate(run))]
    assert kinds == ["push forward", "push backward", "push to the left", "push to the right"]


@pytest.mark.parametrize(
    ("words", "named"),
    [(["upright/own", "--norm", "--set", "duration=2.0"], "expected at least"),
     (["upright/own", "--norm", "--growth"], "--growth or --norm"), (["--reference", "--norm"], "neither --reference")],
)  # fmt: skip
def test_what_cannot_be_measured_is_named(words, named, capsys):
    assert main(["stability", *words, "--jobs", "1"]) in (1, 2)
    assert named in capsys.readouterr().err


@pytest.mark.slow
def test_on_a_stable_cycle_pushes_either_way_upset_steps_alike(capsys):
    """Where the response is linear, so is the norm: docs/stability.md has the cycle's multipliers."""
    assert main(["stability", "level_slow_generalized", "--norm", "--json"]) == 0
    forward, backward, *_ = json.loads(capsys.readouterr().out)["kinds"]
    assert forward["norm"] == pytest.approx(backward["norm"], rel=0.3)
