"""What a law of a user's own logged, in the table of a campaign that is kept in parts."""

from __future__ import annotations

from biped.ensemble.rows import Row
from biped.ensemble.table import records, schema_of, table
from biped.scenario.keys import Scenario


def test_signals_of_rows_come_back_and_need_no_names_beforehand():
    ended = {"fell": False, "end": "completed", "cause": "", "walked": True, "stood": 0, "time": 1.0}
    common = {"seed": 1, "values": {}, **ended}
    signals = {"error": {"mean": 0.5, "min": 0.0, "max": 1.0}, "b": {"mean": 2.0, "min": 2.0, "max": 2.0}}
    rows = [Row(index=0, **common), Row(index=1, signals=signals, **common)]
    schema = schema_of(Scenario())
    back = list(records(table(rows, schema)))
    assert "signals" not in back[0]
    assert back[1]["signals"] == signals
    assert table(rows[:1], schema).schema == table(rows[1:], schema).schema
