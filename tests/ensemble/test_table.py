"""Rows as a table: whatever they hold comes back."""

from __future__ import annotations

import msgspec
import pytest

from biped.base.writing import dumps
from biped.ensemble.campaign import run_one
from biped.ensemble.plan import Plan
from biped.ensemble.rows import records, schema_of, table
from biped.scenario.reading import read_scenario
from tests.cases import ENSEMBLE, write

pytestmark = pytest.mark.usefixtures("folder")


def test_rows_come_back_from_their_table():
    sweep = '[sweep]\n"ground.slope" = [0.0, 2.0]\n"start.posture" = ["single", "flat"]\n'
    write(
        "s.toml", ENSEMBLE.replace("duration = 0.4", "duration = 0.31").replace("start = 0.3", "start = 0.25") + sweep
    )
    plan = Plan(read_scenario("s.toml", ["randomise.runs=2", "randomise.draw.window={choice=[1.0]}"][:1]))
    rows = [run_one(plan, index)[1] for index in range(len(plan))]
    assert any(row.leg_states is None for row in rows)
    assert any(row.leg_states is not None for row in rows)
    again = list(records(table(rows, schema_of(plan.scenario))))
    assert [dumps(record) for record in again] == [dumps(row.as_dict()) for row in rows]


def test_a_column_of_numbers_and_words_keeps_both():
    plan = Plan(read_scenario("e.toml"))
    schema = schema_of(plan.scenario)
    assert str(schema.field("values.ground.friction").type) == "double"
    mixed = msgspec.structs.replace(plan.scenario, sweep={"start.posture": ("flat", 1.0, True)})
    rows = [run_one(plan, index)[1] for index in range(3)]
    told = [
        msgspec.structs.replace(row, values=row.values | {"start.posture": value})
        for row, value in zip(rows, ("flat", 1.0, True), strict=True)
    ]
    found = [record["values"]["start.posture"] for record in records(table(told, schema_of(mixed)))]
    assert found == ["flat", 1.0, True]
    assert [type(value) for value in found] == [str, float, bool]
