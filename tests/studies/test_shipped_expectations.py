"""What the shipped scenarios expect of themselves holds: `[expect]` of each, on its first runs."""

from __future__ import annotations

from functools import cache

import pytest

import biped
from biped.base.files import names
from biped.scenario.engines import DRAKE
from biped.scenario.reading import read_scenario
from biped.studies.run import plan_of

RUNS = 24
"""Most runs of a scenario: bounds on shares that so few cannot decide are undecided, and do not fail."""


@cache
def expecting() -> list[str]:
    """Scenarios that expect something and need no engine beyond those that everybody has."""
    found = [(name, read_scenario(name)) for name in names("scenarios") if not name.startswith("tune/")]
    return [name for name, scenario in found if scenario.expect and scenario.engine != DRAKE]


@pytest.mark.slow
@pytest.mark.parametrize("name", expecting())
def test_what_a_shipped_scenario_expects_holds(name):
    plan = plan_of(name, [])
    each = plan.scenario.randomise.runs
    fewer = min(each, max(2, RUNS * each // len(plan)))  # of every point of a sweep
    if plan.scenario.standard and set(plan.scenario.expect) - {"walked"}:
        fewer = each  # its bounds are on means over what the docs' tables have, which fewer runs would miss by chance
    result = biped.check(name, **({} if fewer == each else {"randomise.runs": fewer}))
    assert result.checks
    assert not [check for check in result.checks if check["passed"] is False]
