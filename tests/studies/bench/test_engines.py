"""The bench of Drake's step: at states of a walk, with the contacts that it has there."""

from __future__ import annotations

import json
from importlib import util

import pytest

from biped.base.errors import InputError
from biped.cli import main as cli
from biped.studies.bench import costs
from biped.studies.bench.costs import STRIDE, step_cost, step_costs
from biped.studies.run import plan_of


def test_without_drake_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setattr(costs, "find_spec", lambda name: None if name == "pydrake" else util.find_spec(name))
    with pytest.raises(InputError, match="pip install drake"):
        step_costs()


def test_steps_are_made_at_the_states_of_the_walk(monkeypatch):
    """Of every third tick one; of those some in double support, where Drake has the most to solve."""
    pytest.importorskip("pydrake", reason="Drake is not installed")
    from biped.engines.sap.stepper import Stepper

    touching, original = [], Stepper.step

    def step(self, measured=False):
        found = original(self, measured)
        touching.append(len(found))
        return found

    monkeypatch.setattr(Stepper, "step", step)
    run = plan_of("upright/own", ["duration=1.2", "window={start=0.1, end=1.2}"]).run(0)
    cost = step_cost(run, repeats=1)
    assert cost.states == len(touching) - 1 == -(-run.ticks // STRIDE)  # one builds the plant
    assert max(touching) >= 3
    assert min(touching) >= 1


def test_command_prints_ratios_to_mujocos_step(monkeypatch, capsys):
    cost = costs.StepCost(10, 5.0, 60.0, 75.0, 110.0)
    monkeypatch.setattr(costs, "step_costs", lambda: {"seven links": cost})
    assert cli.main(["bench", "engines", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)["seven links"]
    assert (printed["update_ratio"], printed["step_ratio"], printed["memory"]) == (12.0, 15.0, 110.0)
    assert cli.main(["bench", "engines"]) == 0
    assert "15.0" in capsys.readouterr().out
