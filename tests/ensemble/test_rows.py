"""Rows: a record with every metric, whose JSON is what results have always held."""

from __future__ import annotations

import json
import math
import re

import msgspec
import pytest

from biped.base.writing import dumps, with_nan
from biped.ensemble.campaign import run_one
from biped.ensemble.plan import Plan
from biped.ensemble.rows import LOST, Row, RowHead
from biped.scenario.keys import Scenario, Window
from biped.scenario.metrics import METRICS

FIRST = ("index", "seed", "values", "fell", "end", "cause", "verdict", "doubt")
LAST = ("leg_states", "per_joint", "signals", "warnings")


def test_a_row_has_every_metric_in_the_order_of_all_tables():
    assert Row.__struct_fields__ == (*FIRST, *(name for name in METRICS if name != "falls"), *LAST)


def test_every_field_says_what_it_is():
    described = [name for kind in (RowHead, Row) for name in re.findall(r"^ {8}(\w+): ", kind.__doc__, re.MULTILINE)]
    assert sorted([*described, *METRICS]) == sorted([*Row.__struct_fields__, "falls"])


@pytest.mark.parametrize("duration", [0.3, 0.05])
def test_a_run_comes_back_from_its_json(duration):
    _, row = run_one(Plan(Scenario(duration=duration, window=Window(start=0.02))), 0)
    record = row.as_dict()
    again = Row.of(with_nan(json.loads(dumps(record))))
    assert dumps(again.as_dict()) == dumps(record), "the same bytes"
    assert [type(value) for value in again.as_dict().values()] == [type(value) for value in record.values()]


def test_rows_are_frozen():
    row = Row(index=0, seed=0, values={}, fell=False, end=LOST, cause="", walked=False, stood=0, time=0.0)
    assert row.lost
    assert math.isnan(row.speed)
    with pytest.raises(AttributeError):
        row.walked = True
    assert msgspec.structs.replace(row, end="fell").lost is False
